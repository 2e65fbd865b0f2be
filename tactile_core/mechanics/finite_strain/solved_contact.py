"""State of a contact of a finite-strain solid, criteria for when an iteration has found it, and errors if none has."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...errors import TactileError
from ...geometry.indenters import Pose
from ..solids.finite_strain import State
from .contact_set import ContactSet
from .penalty_points import Push


@dataclasses.dataclass
class ContactState:
    """A solved contact.
    depth : m, from the problem's own pose; pose : of the indenter now; state : of the solid
    outer, inner : contact of the surface with the indenter, and of the inner skin with the core
    push : forces of the indenter on the penalty points between nodes; guarded : true if these points are in use
    fluid : Pa, rise of the fluid's pressure
    iterations : Newton iterations of the last load step; steps : load steps since the start, failed ones counted"""

    depth: float
    pose: Pose
    state: State
    outer: ContactSet
    inner: ContactSet
    push: Push
    guarded: bool = False
    fluid: float = 0.0
    iterations: int = 0
    steps: int = 0

    @property
    def force(self) -> np.ndarray:
        """Total force (3,) N of the indenter on the sensor."""
        return self.outer.forces.sum(axis=0) + self.push.total


@dataclasses.dataclass(frozen=True)
class Tolerance:
    """Criteria that end an iteration: gaps below ``gap``, and an imbalance below ``balance`` or a step below ``step``.

    gap : m; balance : residual over the largest internal nodal force, or the fluid's excess volume over its volume
    step : m; after so small a step forces are in balance, by quadratic convergence"""

    gap: float
    balance: float
    step: float = 0.0


EXACT = Tolerance(1e-9, 1e-8, 1e-13)


class NoEquilibriumError(TactileError):
    """Error of a path of load steps that ends early: beyond its last contact no equilibrium is found."""


class NotConvergedError(Exception):
    """Error of one load step whose iterations find no equilibrium; the path then tries smaller steps."""
