"""State of a solved contact of an indenter with a sensor's surface."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...geometry.indenters import Pose
from .compliance import Compliance
from .compliance_rows import sensing_gaps, surface_motion

Loads = tuple[np.ndarray, np.ndarray, np.ndarray]  # nodes (k,) that carry force, (k, 3) N, and whether they slip (k,)


@dataclasses.dataclass(frozen=True)
class Contact:
    """Solved contact. Lengths m, forces N, exerted by the indenter on the sensor.

    pose : where the indenter stands; depth : how far that is along the motion from the problem's pose
    force : (3,); axial_force : its part along the motion
    nodes : (k,) touchable indices that carry force; nodal_force : (k, 3), with what is pushed between nodes as loads on
        those whose cubic interpolation it is, some of them small and outward
    slipping : (k,) bool, nodes whose friction is spent; without friction all
    converged : whether it may be used; iterations : linearised problems solved for it
    core_nodes : (c,) inner sensing points that press on the core; core_force : (c,), on the skin, away from the core
    penetration : m, deepest place of a node in the indenter or of the inner skin in the core
    sideways : nodal forces across the indenter's normals over the whole force: 0 without friction
    """

    compliance: Compliance = dataclasses.field(repr=False)
    pose: Pose
    depth: float
    force: np.ndarray
    axial_force: float
    nodes: np.ndarray
    nodal_force: np.ndarray
    slipping: np.ndarray
    converged: bool
    iterations: int
    core_nodes: np.ndarray
    core_force: np.ndarray
    penetration: float
    sideways: float

    @functools.cached_property
    def displacement(self) -> np.ndarray:
        """Displacement (n, 3) float32, m, of the whole surface; computed on first use."""
        return surface_motion(self.compliance, self.nodes, self.nodal_force, self.core_nodes, self.core_force)

    def at_depth(self, depth: float) -> Contact:
        """Return the same contact with its depth, m, measured from another first touch."""
        moved = dataclasses.replace(self, depth=depth)
        if "displacement" in vars(self):  # is known already, and does not depend on it
            vars(moved)["displacement"] = self.displacement
        return moved

    @property
    def deformed(self) -> np.ndarray:
        """Deformed positions (n, 3) m of the surface's nodes."""
        return self.compliance.surface.rest + self.displacement

    @property
    def sensing_gaps(self) -> np.ndarray:
        """Gaps (w,) m of the sensing points: 19 electrodes, then inner skin over the core, then beside it."""
        return self._gaps(len(self.compliance.watch_gap))

    @property
    def electrode_gaps(self) -> np.ndarray:
        """Film (19,) m over each electrode; none on the DIGIT."""
        return self._gaps(self.compliance.feet)

    def _gaps(self, count: int) -> np.ndarray:
        return sensing_gaps(self.compliance, self.nodes, self.nodal_force, self.core_nodes, self.core_force, count)

    @property
    def fluid_pressure(self) -> float:
        """Pa, by which the fluid's has risen."""
        at_nodes = self.compliance.pressure.reshape(-1, 3)[self.nodes]
        at_core = self.compliance.inner_pressure[self.core_nodes]
        return float((self.nodal_force * at_nodes).sum() + self.core_force @ at_core)


def sideways_share(force: np.ndarray, normal: np.ndarray) -> float:
    """Return the forces (k, 3) N across the normals (k, 3) there, over the whole force."""
    size = np.linalg.norm(force.sum(axis=0))
    across = force - np.einsum("ai,ai->a", force, normal)[:, None] * normal
    return float(np.linalg.norm(across) / size) if size else 0.0


def borne(before: Contact, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces (k, 3) N that nodes (k,) bore in a contact, and which of them slipped (k,)."""
    force, slipping = np.zeros((len(nodes), 3)), np.zeros(len(nodes), bool)
    same = among(nodes, before.nodes)
    at = np.searchsorted(before.nodes, nodes[same])
    force[same], slipping[same] = before.nodal_force[at], before.slipping[at]
    return force, slipping


def among(nodes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Mark (k,) bool the nodes (k,) that are among sorted others (j,); a few times quicker than ``np.isin``."""
    if not len(others):
        return np.zeros(len(nodes), bool)
    return others[np.minimum(np.searchsorted(others, nodes), len(others) - 1)] == nodes
