"""Frictionless contact that keeps an indenter out between a surface's nodes as well.

Without friction nodes slide off edges and round wires, which then sink in between them (``penetration``). Here points
halfway between nodes touch as well, each through a spring much stiffer than the surface, so that there are never more
forces than motions to find. It costs a hundred times as much, and is for contacts that nodes alone do not hold.
"""

from __future__ import annotations

import math

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ..penetration import check_follows, penetration_between
from .active_set import Work
from .candidates import Candidates
from .compliance import Compliance
from .compliance_block import ComplianceBlock
from .contact import ContactProblem
from .contact_state import Contact
from .frictionless import Frictionless, Try
from .interpolated_points import SpringRows, interpolated_points

_SLACK = 20e-6  # m, in which the points do not push, as in the full tier (``penalty_points``)
# Of a spring, over a surface node's by itself: of 14 rings 1 to 1.9 mm deep 13 settled with 10, all with 20, which left
# them 34 to 70 um deep in between nodes.
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
    """Contact with ``slack`` (k,) m, by which points may lie in the indenter before they push."""

    most_curved = 10_000  # all of them: along wires every point feels the turn of its normal
    slack: np.ndarray

    def distance(self, displacement: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray]:
        gap, normal = super().distance(displacement, shift)
        return gap + self.slack, normal


class EdgeContactProblem(ContactProblem):
    """Contact problem without friction whose candidates are nodes, and from number m on points between them."""

    def __init__(
        self, compliance: Compliance, indenter: Indenter, pose: Pose, reach: float, work: Work | None = None
    ) -> None:
        self._points = interpolated_points(compliance.surface, compliance.touchable)
        self._m = len(compliance.touchable)
        row, mirrored, image = compliance.answers
        at = np.where(mirrored, image[compliance.touchable], compliance.touchable)
        own = [np.median(compliance.move[3 * row + axis, 3 * at + axis]) for axis in range(3)]
        self._softness = float(np.mean(own)) / _STIFFNESS
        self._slack = np.repeat([0.0, _SLACK], [self._m, len(self._points.nodes)])
        super().__init__(compliance, indenter, pose, reach, work=work)

    @property
    def nodes_near(self) -> np.ndarray:
        """Sorted touchable indices (n,) of the followed nodes, without the points between them."""
        return self.near[self.near < self._m]

    def check_follows(self, contact: Contact) -> None:
        """Raise PenetrationError where the body is in between nodes in spite of the points, or lies behind nodes."""
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
        """Nodes and points less than ``reach`` m outside the indenter, and what nodes those points depend on."""
        near = np.zeros(self._m, bool)
        near[super()._nodes_within(pose, reach + _MARGIN)] = True
        points = np.flatnonzero(near[self._points.nodes].all(axis=1))
        points = points[pose.distance(self.indenter, self._rest[self._m + points])[0] < reach]
        nodes = np.union1d(super()._nodes_within(pose, reach), self._points.nodes[points])
        return np.concatenate([nodes, self._m + points])

    def _rows_of(self, near: np.ndarray) -> SpringRows:
        return SpringRows(self.compliance, near, self._points, self._softness)

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

    def _on_nodes(self, touching: np.ndarray, force: np.ndarray, slipping: np.ndarray) -> tuple[np.ndarray, ...]:
        nodes, loads = self._rows.on_nodes(touching, force)
        return nodes, loads, np.ones(len(nodes), bool)

    def _place(self, touching: np.ndarray, force: np.ndarray, moved: np.ndarray) -> np.ndarray:
        sprung = touching >= self._m
        moved[np.searchsorted(self.near, touching[sprung])] += self._softness * force[sprung]
        return moved
