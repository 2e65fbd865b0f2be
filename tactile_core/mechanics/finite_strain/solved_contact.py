"""A solved contact of a finite-strain solid."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...geometry.indenters import Pose
from ..solids.finite_strain import State
from .contact_set import ContactSet
from .penalty_points import Push


@dataclasses.dataclass
class ContactState:
    """A solved contact. depth : m, from the problem's own pose; state : of the solid; outer, inner : what touches.

    pose : of the indenter; push : on the surface between nodes, once that is ``guarded``
    fluid : Pa, rise of the fluid's pressure
    iterations : Newton iterations of the last load step; steps : load steps, halved ones counted
    """

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
    def nodes(self) -> np.ndarray:
        """Mesh nodes (k,) that the indenter touches."""
        return self.outer.nodes

    @property
    def pressing(self) -> np.ndarray:
        """Normal forces (k,) N of the indenter on ``nodes``."""
        return self.outer.pressing

    @property
    def normals(self) -> np.ndarray:
        """Normals (k, 3) of the indenter at ``nodes``."""
        return self.outer.normals

    @property
    def force(self) -> np.ndarray:
        """Total force (3,) N of the indenter on the sensor."""
        return self.outer.forces.sum(axis=0) + self.push.total


def guarded(touch: ContactState) -> ContactState:
    """Return the same contact with a surface that keeps the indenter out between its nodes, to continue from."""
    return dataclasses.replace(touch, guarded=True)
