"""Input (``Step``) and result (``Solution``) of contact mechanics, the same in every tier."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Literal

import numpy as np

from ..files.short_text import Summary
from .solids.finite_strain import FiniteStrainSolid, State

Sensor = str  # name of a sensor, such as "biotac"
Tier = Literal["fast", "full", "reference"]
TIERS: tuple[Tier, ...] = ("fast", "full", "reference")


@dataclasses.dataclass(frozen=True)
class Step:
    """A point of a path: ``depth`` m or ``force`` N along the motion, and ``slide`` (2,) m from the first touch.

    slide : along the finger and across it, in the indenter's own axes
    """

    depth: float | None = None
    force: float | None = None
    slide: tuple[float, float] = (0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class OnDemand:
    """Functions that compute the costly parts of a ``Solution``: its properties of the same names."""

    electrode_gaps: Callable[[], np.ndarray]
    films: Callable[[], np.ndarray]
    traction: Callable[[], np.ndarray]
    errors: Callable[[], tuple[float, float]]


@dataclasses.dataclass(frozen=True, repr=False)
class Solution(Summary):
    """A solved contact, SI units, whatever the tier.

    tier : which solver made it; converged : whether it may be used; iterations : of its last step
    displacement : (n, 3) m of the sensor's surface nodes; contact_patch : (n,) bool, nodes that carry force
    thickness : m, of the sensor at the place of first touch
    force : (3,) N, exerted by the indenter on the sensor; axial_force : N, along the motion; depth : m from first touch
    pressure : Pa, rise of the BioTac's fluid pressure, 0 for the DIGIT
    centre : (2,) = (x, z) m, of pressure, on the resting surface; NaN without contact
    penetration : m, largest depth of a node in the indenter or the core; slipping : share of touching nodes that slip
    core_nodes : number of inner-skin nodes that press on the core; load_steps : number since the solution before
    volume : the solid and its state, of the full and the reference tier
    between : (m, 3) N, loads on the solid's nodes that stand for forces between nodes (penalty points), if any
    """

    tier: Tier
    converged: bool
    iterations: int
    displacement: np.ndarray
    contact_patch: np.ndarray
    thickness: float
    force: np.ndarray
    axial_force: float
    depth: float
    pressure: float
    centre: np.ndarray
    penetration: float
    slipping: float
    core_nodes: int
    on_demand: OnDemand = dataclasses.field(repr=False)
    load_steps: int = 1
    volume: tuple[FiniteStrainSolid, State] | None = dataclasses.field(default=None, repr=False)
    between: np.ndarray | None = None

    @functools.cached_property
    def electrode_gaps(self) -> np.ndarray:
        """Film (e,) m over each electrode; (0,) on a gel. The fast tier's is not corrected."""
        return self.on_demand.electrode_gaps()

    @functools.cached_property
    def films(self) -> np.ndarray:
        """Film (k,) m at the nodes of the conducting sheet; (0,) on a gel. The fast tier's is not corrected."""
        return self.on_demand.films()

    @functools.cached_property
    def traction(self) -> np.ndarray:
        """Traction (n, 3) Pa of the indenter on the surface; its sum, weighted by ``node_areas``, is the force.

        Raises TactileError in the full and the reference tier, whose forces act on the nodes of their own meshes.
        """
        return self.on_demand.traction()

    @property
    def shape_error(self) -> float:
        """Error, m rms over nodes that move more than 10 um, that 95 of 100 such contacts stay below."""
        return self._errors[0]

    @property
    def force_error(self) -> float:
        """Relative error of the force that 95 of 100 such contacts stay below."""
        return self._errors[1]

    @functools.cached_property
    def _errors(self) -> tuple[float, float]:
        return self.on_demand.errors()


def centre_of_pressure(places: np.ndarray, nodal_force: np.ndarray) -> np.ndarray:
    """Return the centre (2,) = (x, z) m of places (k, 3) m, weighted by nodal_force (k, 3) N; NaN without any."""
    weight = np.linalg.norm(nodal_force, axis=1)
    return weight @ places[:, [0, 2]] / weight.sum() if weight.any() else np.full(2, np.nan)
