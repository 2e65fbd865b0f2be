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
    """A point of a path: either ``depth``, m from first touch, or ``force``, N along the motion; the other is None.

    slide : m, sideways from the place of first touch, along the indenter's own axes: one along the finger, one across
    """

    depth: float | None = None
    force: float | None = None
    slide: tuple[float, float] = (0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class OnDemand:
    """Functions that compute a ``Solution``'s costly properties of the same names, each when first asked for."""

    electrode_gaps: Callable[[], np.ndarray]
    films: Callable[[], np.ndarray]
    traction: Callable[[], np.ndarray]
    errors: Callable[[], tuple[float, float]]


@dataclasses.dataclass(frozen=True, repr=False)
class Solution(Summary):
    """A solved contact, SI units, whatever the tier.
    tier : fast, full or reference; converged : false if it ended early: do not use it; iterations : of its last step
    displacement : (n, 3) m of the sensor's surface nodes; contact_patch : (n,) bool, nodes that carry force
    thickness : m, of the sensor at the place of first touch
    force : (3,) N, exerted by the indenter on the sensor; axial_force : N, along the motion; depth : m from first touch
    pressure : Pa, rise of the BioTac's fluid pressure, 0 for a gel
    centre : (2,) = (x, z) m, centre of pressure on the resting surface; NaN without contact
    penetration : m, largest depth of a surface node in the indenter; of the fast tier, also of inner skin in the core
    slipping : share, 0 to 1, of touching nodes that slip; 0 without friction
    core_nodes : number of inner-skin nodes that press on the core; on_demand : functions behind the costly properties
    load_steps : number of load steps since the solution before
    volume : the solid and its state, from the full and the reference tier; None from the fast one
    between : (m, 3) N, loads on the solid's nodes that stand for forces between nodes (penalty points); None without"""

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
        """Thickness (e,) m of the fluid film over each electrode; (0,) on a gel. The fast tier gives that of its linear
        part, without the learned correction."""
        return self.on_demand.electrode_gaps()

    @functools.cached_property
    def films(self) -> np.ndarray:
        """Thickness (k,) m of the fluid film at the nodes of the conducting sheet; (0,) on a gel. The fast tier gives
        that of its linear part, without the learned correction."""
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
    """Return the mean (2,) = (x, z) m of places (k, 3) m, weighted by the size of nodal_force (k, 3) N; NaN if 0."""
    weight = np.linalg.norm(nodal_force, axis=1)
    return weight @ places[:, [0, 2]] / weight.sum() if weight.any() else np.full(2, np.nan)
