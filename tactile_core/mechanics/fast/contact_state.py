"""States of an indenter's contact with a surface: the solved contact, and the candidates among which it is sought.

Candidates are the nodes that enter a solve; functions here place them at its start and add those that are missing.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ...geometry.indenters.indenter import lengths
from .compliance import Compliance
from .compliance_rows import sensing_gaps, surface_motion

Loads = tuple[np.ndarray, np.ndarray, np.ndarray]  # nodes (k,) that carry force, (k, 3) N, and whether they slip (k,)


@dataclasses.dataclass(frozen=True)
class Contact:
    """Solved contact. Lengths m, forces N, exerted by the indenter on the sensor.
    pose : of the indenter; depth : its distance along the motion from the problem's pose
    force : (3,); axial_force : its part along the motion
    nodes : (k,) positions in ``touchable`` of nodes that carry force; nodal_force : (k, 3). Forces on points between
        nodes are spread over the nodes they are interpolated from: some of these then have a small outward force
    slipping : (k,) bool, nodes whose friction is at its limit; without friction all
    converged : false if the solve ended early: do not use it; iterations : linearised problems solved for it
    core_nodes : (c,) inner sensing points that press on the core; core_force : (c,), on the skin, away from the core
    penetration : m, the largest depth of a node in the indenter or of the inner skin in the core
    sideways : norm of nodal forces' parts across the indenter's normals, over the whole force; 0 without friction"""

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
        """Return this contact with another ``depth``, m, as counted from first touch at another place."""
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
        """Gaps (w,) m of the sensing points: inner skin under the electrodes, then facing the core, then beside it."""
        return self._gaps(len(self.compliance.watch_gap))

    @property
    def electrode_gaps(self) -> np.ndarray:
        """Thickness (e,) m of the fluid film over each electrode; (0,) on a gel."""
        return self._gaps(self.compliance.feet)

    def _gaps(self, count: int) -> np.ndarray:
        return sensing_gaps(self.compliance, self.nodes, self.nodal_force, self.core_nodes, self.core_force, count)

    @property
    def fluid_pressure(self) -> float:
        """Rise of the fluid's pressure, Pa."""
        at_nodes = self.compliance.pressure.reshape(-1, 3)[self.nodes]
        at_core = self.compliance.inner_pressure[self.core_nodes]
        return float((self.nodal_force * at_nodes).sum() + self.core_force @ at_core)


def sideways_share(force: np.ndarray, normal: np.ndarray) -> float:
    """Return the norm of force (k, 3) N across unit vectors normal (k, 3), over the size of the summed force."""
    size = np.linalg.norm(force.sum(axis=0))
    across = force - np.einsum("ai,ai->a", force, normal)[:, None] * normal
    return float(np.linalg.norm(across) / size) if size else 0.0


def borne(before: Contact, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (k, 3) N that ``nodes`` (k,), positions in ``Compliance.touchable``, bore in the contact
    ``before``, 0 for others, and which of them slipped (k,) bool."""
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


# m, tried in turn: how far beside a concave crease a face's distance is measured, so that this face is the nearer one.
_CREASE_PROBES = (10e-6, 40e-6, 120e-6, 400e-6)
_MOST_LOOKS = 3  # for a node's second face: while it is still far from its place, only one may be seen (assumed)
_SAME_FACE = 0.97  # cosine between the normal that was seen and the one found there
_ARRIVED = 1e-8  # m, at which a point has landed
_TRACE_STEPS = 6  # of sphere tracing: the start of an iteration needs no more
_MET = 1e-10  # m, at which a point has met the indenter
_SPOT_STEPS = 20  # where a node sticks matters, so its spot is found to well below a micrometre


@dataclasses.dataclass
class Candidates:
    """Nodes that may carry force, sorted; a node stands twice if it touches both faces of a concave crease.
    nodes : (k,) positions in ``Compliance.touchable``; displacement : (k, 3) m, first guess
    probe : (k, 3) m, offset from a node in a crease to where the distance of its face is measured, else 0
    active : (k,) bool, first guess of which touch; inner : (c,) sensing points that may press on the core
    looks : (k,) int, how often ``split`` sought a node's second face; once it is found, `_MOST_LOOKS` (``faced``)"""

    nodes: np.ndarray
    displacement: np.ndarray
    probe: np.ndarray
    active: np.ndarray
    inner: np.ndarray
    looks: np.ndarray

    @property
    def faced(self) -> np.ndarray:
        """Return which nodes (k,) bool need not be searched any more for a second face of the indenter that they touch:
        one was found, and the node stands twice in the list, or `_MOST_LOOKS` searches found none."""
        return self.looks >= _MOST_LOOKS

    def go_on(self, displacement: np.ndarray, active: np.ndarray) -> None:
        """Make displacement (k, 3) m and the first k of active (k + c,) bool the new first guess."""
        self.displacement, self.active = displacement, active[: len(self.nodes)]

    def add(self, nodes: np.ndarray, displacement: np.ndarray, probe: np.ndarray) -> None:
        """Add nodes (j,), which at first touch; displacement, probe : (j, 3) m, as in the class"""
        self.looks = np.concatenate([self.looks, np.where(np.isin(nodes, self.nodes), _MOST_LOOKS, 0)])
        every = np.concatenate([self.nodes, nodes])
        order = np.argsort(every, kind="stable")
        self.nodes, self.looks = every[order], self.looks[order]
        self.displacement = np.concatenate([self.displacement, displacement])[order]
        self.probe = np.concatenate([self.probe, probe])[order]
        self.active = np.concatenate([self.active, np.ones(len(nodes), bool)])[order]

    def split(
        self, at: np.ndarray, left: np.ndarray, normals: np.ndarray, indenter: Indenter, pose: Pose, rest: np.ndarray
    ) -> None:
        """Let the nodes at positions ``at`` (j,), if they lie in a concave crease of the indenter at ``pose``, touch
        both of its faces, the one that they are at and the one that they left: each then stands twice.
        left, normals : (j, 3), a point m of the face that each left, and the normal there
        rest : (k, 3) m, of all candidates
        At the crease both faces are equally near, so each face's distance is measured a little beside it (``probe``).
        """
        self.looks[at] += 1
        points = rest[at] + self.displacement[at]
        gap, first = pose.distance(indenter, points)
        crease = _meet(points - gap[:, None] * first, first, left, normals)
        new, probe = np.zeros(len(at), bool), np.zeros_like(normals)
        for reach in _CREASE_PROBES:  # the least at which either face's normal is seen beside the crease
            hit = ~new
            for face, other in ((normals, first), (first, normals)):
                _, found = pose.distance(indenter, crease + reach * other)
                hit &= np.einsum("ai,ai->a", found, face) > _SAME_FACE
            probe[hit], self.probe[at[hit]] = reach * first[hit], reach * normals[hit]
            new |= hit
        self.looks[at[new]] = _MOST_LOOKS
        self.displacement[at[new]] = (crease - rest[at])[new]
        self.add(self.nodes[at[new]], self.displacement[at[new]], probe[new])


def _meet(points: np.ndarray, first: np.ndarray, others: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the points (j, 3) m on the lines where two planes meet that are nearest to ``points``, which lie in the
    first plane; ``others`` (j, 3) m lie in the second. first, second : (j, 3), the planes' unit normals"""
    across = second - np.einsum("ai,ai->a", second, first)[:, None] * first
    way = np.einsum("ai,ai->a", others - points, second) / np.einsum("ai,ai->a", across, second)
    return points + way[:, None] * across


def project(indenter: Indenter, pose: Pose, points: np.ndarray, far: float) -> np.ndarray:
    """Return the displacements (n, 3) m, along the motion, that bring points (n, 3) m in an indenter at ``pose`` to its
    front; points in front of it stay.
    far : m, the most that a point may lie in the indenter"""
    own, travel, on_way = pose.to_own(points), np.full(len(points), far), np.arange(len(points))
    ahead = pose.own_direction
    for _ in range(_TRACE_STEPS):
        place = own.take(on_way, axis=0) + travel[on_way, None] * ahead
        gap, _ = indenter.distance(place)
        travel[on_way] -= np.maximum(gap, 0)
        on_way = on_way[(gap > _ARRIVED) & (travel[on_way] > 0)]
        if not len(on_way):
            break
    return np.maximum(travel, 0)[:, None] * pose.direction


def first_contact(indenter: Indenter, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return the places (n, 3) m where nodes that move straight from ``first`` to ``last``, (n, 3) m, first meet an
    indenter, all in its frame: ``last`` for nodes that do not meet it, ``first`` for those that begin inside it."""
    way = last - first
    share, on_way = np.zeros(len(first)), np.arange(len(first))
    start, ahead, gone, length = first, way, share.copy(), np.maximum(lengths(way), 1e-12)  # of those on their way
    for _ in range(_SPOT_STEPS):
        gap, _ = indenter.distance(start + gone[:, None] * ahead)
        gone = np.minimum(gone + np.maximum(gap, 0) / length, 1)
        share[on_way] = gone
        left = np.flatnonzero((gap > _MET) & (gone < 1))
        if not len(left):
            break
        if len(left) < len(on_way):
            on_way, start, ahead = on_way[left], start.take(left, axis=0), ahead.take(left, axis=0)
            gone, length = gone[left], length[left]
    return first + share[:, None] * way
