"""Frictionless contact that keeps an indenter out between a surface's nodes as well.

Without friction nodes slide off edges and round wires, which then sink in between them (``penetration``). Here points
halfway between nodes touch as well, each through a spring much stiffer than the surface, so that there are never more
forces than motions to find. It costs a hundred times as much, and is for indenters that nodes let through.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...geometry.cubic_spline import stencil
from ...geometry.indenters import Indenter, Pose
from ...geometry.lattice import Lattice
from ..penetration import SLACK, check_follows, penetration_between
from .active_set import Work
from .compliance import Compliance
from .compliance_rows import ComplianceBlock, ComplianceRows
from .contact import ContactProblem
from .contact_state import Candidates, Contact, Loads
from .frictionless import Frictionless, Try

# Stiffness of a spring, over that of a surface node by itself: of 14 rings 1 to 1.9 mm deep 13 settled with 10, all
# with 20, at a penetration of 34 to 70 um between nodes.
_STIFFNESS = 20.0
# m: nodes this close to the indenter touch it. Others carry what points push as well.
_ON_BODY = 1e-6
# As ``penetration.BEHIND``: held out between nodes, a gel closes round a wire pressed in deeper than its radius.
_BEHIND = -0.8
_MOST = 1500  # nodes and points that may touch: more take gigabytes and minutes (rings need 500)
_MARGIN = 1.9e-3  # m: no point is farther from a node that it depends on (1.85 mm at the gel's rim)
_STEP = 0.3e-3  # m of the motion, at most: in longer steps nodes land on the far side of a wire
_DETOUR = 9  # steps, where that does not settle


class _Sprung(Frictionless):
    """Contact whose points push once they lie in the indenter by ``slack`` (k,) m."""

    most_curved = 10_000  # all of them: along wires every point feels the turn of its normal
    slack: np.ndarray

    def distance(self, displacement: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray]:
        """Return ``slack`` plus the signed distances (k,) m, and the normals (k, 3), of points under a displacement (k,
        3) m, the indenter moved by shift m along its motion."""
        gap, normal = super().distance(displacement, shift)
        return gap + self.slack, normal


class EdgeContactProblem(ContactProblem):
    """Contact problem without friction on the m touchable nodes and, numbered from m on, points between them.
    pose : at depth 0; reach : m, depth up to which nodes are checked; work : budget of computing, or None"""

    def __init__(
        self, compliance: Compliance, indenter: Indenter, pose: Pose, reach: float, work: Work | None = None
    ) -> None:
        self._points = interpolated_points(compliance.surface, compliance.touchable)
        self._m = len(compliance.touchable)
        row, mirrored, image = compliance.answers
        at = np.where(mirrored, image[compliance.touchable], compliance.touchable)
        own = [np.median(compliance.move[3 * row + axis, 3 * at + axis]) for axis in range(3)]
        self._softness = float(np.mean(own)) / _STIFFNESS
        self._slack = np.repeat([0.0, SLACK], [self._m, len(self._points.nodes)])
        super().__init__(compliance, indenter, pose, reach, work=work)

    @property
    def nodes_near(self) -> np.ndarray:
        """Sorted positions (n,) in ``touchable`` of the checked nodes, without the points between them."""
        return self.near[self.near < self._m]

    def check_follows(self, contact: Contact) -> None:
        """Raise PenetrationError if in a solved contact, in spite of the points, the indenter is over 0.1 mm deep
        between nodes or has nodes behind it."""
        surface, deformed = self.compliance.surface, contact.deformed
        gap, normals = contact.pose.distance(self.indenter, deformed[self.compliance.touchable])
        normals = normals[np.abs(gap) < _ON_BODY]
        where, grid = f"fast tier, {self.compliance.name}", surface.grid(deformed)
        of = self.indenter, contact.pose, contact.depth
        penetration_between(where, grid, *of, closed=surface.closed, share=0.0)
        check_follows(where, grid, *of, normals, closed=surface.closed, behind=_BEHIND)

    def _resting(self) -> np.ndarray:
        nodes = super()._resting()
        return np.concatenate([nodes, self._points.interpolate(nodes)])

    def _nodes_within(self, pose: Pose, reach: float) -> np.ndarray:
        """Return the indices of surface nodes, and of the points between them (``_m`` + point), that lie inside the
        indenter or less than ``reach`` m outside; the nodes that such a point is interpolated from are included."""
        near = np.zeros(self._m, bool)
        near[super()._nodes_within(pose, reach + _MARGIN)] = True
        points = np.flatnonzero(near[self._points.nodes].all(axis=1))
        points = points[pose.distance(self.indenter, self._rest[self._m + points])[0] < reach]
        nodes = np.union1d(super()._nodes_within(pose, reach), self._points.nodes[points])
        return np.concatenate([nodes, self._m + points])

    def _rows_of(self, near: np.ndarray) -> SpringRows:
        self._springs = SpringRows(self.compliance, near, self._points, self._softness)
        return self._springs

    def _distance(self, pose: Pose, nodes: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        gap, normal = super()._distance(pose, nodes, moved)
        return gap + self._slack[nodes], normal

    def _iterate(self, pose: Pose, axial_force, before: Contact, moved, candidates: Candidates, shift) -> Try | None:  # noqa: ANN001
        if len(candidates.nodes) > _MOST:
            return None
        return super()._iterate(pose, axial_force, before, moved, candidates, shift)

    def _frictionless(
        self, block: ComplianceBlock, rest: np.ndarray, core_gap: np.ndarray, pose: Pose, candidates: Candidates
    ) -> Frictionless:
        solver = _Sprung(block, rest, core_gap, self.indenter, pose, candidates.probe, candidates.faced)
        solver.slack = self._slack[candidates.nodes]
        return solver

    def _walk(self, pose: Pose, axial_force: float | None, start: Contact | None) -> Contact:
        travel = float(np.linalg.norm(pose.apex - (start or self).pose.apex))
        for steps in (max(math.ceil(travel / _STEP), 1), _DETOUR):
            contact = self._steps(pose, axial_force, start, steps)
            if contact.converged:
                break
        return contact

    def _on_nodes(self, touching: np.ndarray, force: np.ndarray, slipping: np.ndarray) -> Loads:
        nodes, loads = self._springs.on_nodes(touching, force)
        return nodes, loads, np.ones(len(nodes), bool)

    def _place(self, touching: np.ndarray, force: np.ndarray, moved: np.ndarray) -> np.ndarray:
        sprung = touching >= self._m
        moved[np.searchsorted(self.near, touching[sprung])] += self._softness * force[sprung]
        return moved


class InterpolatedPoints(NamedTuple):
    """v points, weighted means of 16 nodes each. nodes : (v, 16), positions in ``touchable``; weights : (v, 16)"""

    nodes: np.ndarray
    weights: np.ndarray

    def interpolate(self, values: np.ndarray) -> np.ndarray:
        """Return the values (v, 3) at the points, interpolated from ``values`` (m, 3) at all touchable nodes."""
        return np.einsum("vs,vsi->vi", self.weights, values[self.nodes])


def interpolated_points(lattice: Lattice, touchable: np.ndarray) -> InterpolatedPoints:
    """Return the points amid the lattice's edges and cells whose 16 nodes are all touchable."""
    rows, columns = lattice.shape
    halves = np.mgrid[: 2 * rows - 1, : 2 * columns - (not lattice.closed)].reshape(2, -1)
    between = halves[:, (halves % 2).any(axis=0)] / 2
    nodes, weights = (each.reshape(16, -1).T for each in stencil(lattice.shape, between, closed=lattice.closed))
    number = np.full(len(lattice.rest), -1)
    number[touchable] = np.arange(len(touchable))
    inside = (number[nodes] >= 0).all(axis=1)
    return InterpolatedPoints(number[nodes[inside]], weights[inside])


class SpringRows:
    """Compliance among nodes near an indenter and points between them, as ``ComplianceRows`` among nodes alone.

    near : (n,) sorted: nodes by position in ``touchable``, points numbered on from its end, and all nodes of points
    softness : m/N, of each point's spring
    """

    def __init__(self, compliance: Compliance, near: np.ndarray, points: InterpolatedPoints, softness: float) -> None:
        self.near, self.softness, self._count = near, softness, len(compliance.touchable)
        nodes, number = near[near < self._count], near[near >= self._count] - self._count
        self._rows = ComplianceRows(compliance, nodes)
        # What each of ``near`` is a weighted sum of, as indices into ``nodes``.
        self._nodes = np.concatenate([_alone(np.arange(len(nodes))), np.searchsorted(nodes, points.nodes[number])])
        self._weights = np.concatenate([_alone(np.ones(len(nodes))), points.weights[number]])

    def block(self, numbers: np.ndarray) -> np.ndarray:
        """Return the compliance (3 k, 3 k) float32 m/N, springs included, among numbers (k,), sorted, in ``near``."""
        used, sums = self._sums(numbers)
        among = self._rows.block(used)
        block = np.empty((3 * len(numbers), 3 * len(numbers)), np.float32)
        for j in range(3):  # axis by axis: no more than a third is copied
            half = among[:, j::3] @ sums.T
            for i in range(3):
                block[i::3, j::3] = sums @ half[i::3]
        springs = np.repeat(numbers >= self._count, 3)
        block.reshape(-1)[:: len(block) + 1][springs] += self.softness
        return block

    def sensing_motion(self, numbers: np.ndarray, inner: np.ndarray) -> np.ndarray:
        """Return the motion (3 k, c) float32 m/N of sensing points ``inner`` (c,) under 1 N on each axis of ``numbers``
        (k,), sorted, some of ``near``."""
        used, sums = self._sums(numbers)
        felt = self._rows.sensing_motion(used, inner)
        return (sums @ felt.reshape(len(used), -1)).reshape(3 * len(numbers), len(inner))

    def moved(self, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray) -> np.ndarray:
        """Return ``near``'s motion (n, 3) m by force (k, 3) N on nodes (k,), inner_force (c,) N on inner (c,)."""
        moved = self._rows.moved(nodes, force, inner, inner_force)
        return np.einsum("ns,nsi->ni", self._weights, moved[self._nodes])

    def on_nodes(self, numbers: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Share force (k, 3) N on nodes and points out to nodes alone: return those (j,), sorted, and the forces (j, 3)
        N on them.
        numbers : (k,), where force acts, distinct and sorted, some of ``near``"""
        at = np.searchsorted(self.near, numbers)
        loads = np.zeros((len(self._rows.near), 3))
        np.add.at(loads, self._nodes[at], self._weights[at][:, :, None] * force[:, None])
        carries = loads.any(axis=1)
        return self._rows.near[carries], loads[carries]

    def _sums(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return nodes (u,), sorted, that ``numbers`` (k,), in ``near``, depend on; with weights (k, u) float32."""
        at = np.searchsorted(self.near, numbers)
        sums = np.zeros((len(at), len(self._rows.near)), np.float32)
        np.add.at(sums, (np.arange(len(at))[:, None], self._nodes[at]), self._weights[at])
        used = np.flatnonzero(sums.any(axis=0))
        return self._rows.near[used], sums[:, used]


def _alone(values: np.ndarray) -> np.ndarray:
    """Return values (n,) as the first of 16 columns (n, 16), zeros after them."""
    columns = np.zeros((len(values), 16), values.dtype)
    columns[:, 0] = values
    return columns
