"""Contact of a rigid indenter with a sensor's surface, solved on its compliance; every result is checked.

Only nodes that the indenter may touch enter a solve. Then all nodes near it are displaced and checked: those that would
go through it, and inner skin that would go through the core, are added, and the solve is repeated.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ..penetration import check_follows
from ..placement import between, same_place
from .active_set import UnsolvedError, Work
from .compliance import Compliance
from .compliance_rows import ComplianceBlock, ComplianceRows, Rows, sensing_gaps
from .contact_state import Candidates, Contact, Loads, among, borne, first_contact, project, sideways_share
from .contact_stiffness import ContactStiffness
from .friction import Friction
from .frictionless import Frictionless, Try

PENETRATION = 1e-6  # m, the target at any node
_REACH = 0.8e-3  # m, nodes this far outside the indenter at the end of a solve may come to touch it
_SPARE = 0.15e-3  # m, added to that for the nodes near, so that a deeper contact needs no others (assumed)
_LARGE = 2.5  # times the nodes wanted: checking more costs more than a fresh start (assumed)
_TAKE_IN = 20e-6  # m: where some nodes go through the indenter, those this close to it are taken in with them
_CORE_TAKE_IN = 0.15e-3  # m, likewise for inner skin over the core, where gaps vary more
_CLOSED = 0.3e-6  # m: gaps closed to this need no further look
_MOST_ROUNDS = 12  # of taking in nodes
_DETOURS = (4, 9, 20)  # steps from the start to the goal, where one does not settle: other steps pass other edges
_FAILS_AFTER = 5  # iterations that a solve is taken to have cost which ended without a contact (assumed)
_LIKELY = 0.3  # nodes that overlap the indenter by this share of the deepest overlap are first taken to touch


class _Around(NamedTuple):
    """Effect of a contact on n nodes near it: displacement moved (n, 3) m, gap (n,) m; core_gap (g,) m of the skin."""

    moved: np.ndarray
    gap: np.ndarray
    core_gap: np.ndarray


class ContactProblem:
    """An indenter in front of one sensor; solves contacts at depths, at forces along the motion, and at other poses.

    pose : of the indenter at depth 0; reach : m, depth up to which all nodes that it may touch are near from the start
    friction : Coulomb's coefficient; with it a contact depends on the one it starts from, and on the steps between
    work : budget of computing, None for no limit; a solve raises ExhaustedError once it is used up"""

    def __init__(
        self, compliance: Compliance, indenter: Indenter, pose: Pose, reach: float, friction: float = 0.0,
        work: Work | None = None,
    ) -> None:  # fmt: skip
        self.compliance, self.indenter, self.pose, self.friction = compliance, indenter, pose, friction
        self.work = work or Work()
        self._rest = self._resting()
        self._block: ComplianceBlock | None = None
        self._stiffness = ContactStiffness()
        self._rows: Rows = ComplianceRows(compliance, np.empty(0, int))
        self._look_near(pose.moved(reach))

    def _resting(self) -> np.ndarray:
        """Return rest positions (m, 3) m of the touchable nodes."""
        return self.compliance.surface.rest[self.compliance.touchable]

    def at_depth(self, depth: float, start: Contact | None = None) -> Contact:
        """Solve the contact at a depth, m, from ``start`` (None: from rest). See ``converged`` of the result."""
        return self._walk(self.pose.moved(depth), None, start)

    def at_pose(self, pose: Pose, start: Contact | None = None, axial_force: float | None = None) -> Contact:
        """Solve the contact at another pose, from ``start`` (None: from rest), in one step or, if that does not
        converge, in several. See ``converged`` of the result.
        axial_force : N; the indenter then moves on along its direction until it bears that force; None: it stays there
        """
        self._look_near(pose, start)
        return self._walk(pose, axial_force, start)

    def check_follows(self, contact: Contact) -> None:
        """Raise PenetrationError if the indenter of a solved ``contact`` has penetrated between the surface's nodes."""
        surface, deformed = self.compliance.surface, contact.deformed
        _, normals = contact.pose.distance(self.indenter, deformed[self.compliance.touchable[contact.nodes]])
        where, grid = f"fast tier, {self.compliance.name}", surface.grid(deformed)
        check_follows(where, grid, self.indenter, contact.pose, contact.depth, normals, closed=surface.closed)

    def _look_near(self, pose: Pose, start: Contact | None = None) -> None:
        """Choose the nodes to follow: those that the indenter may reach at a pose, and those that ``start`` touched."""
        wanted = self._nodes_within(pose, _REACH)
        touched = np.empty(0, int) if start is None else start.nodes
        held = among(wanted, self.near).all() and among(touched, self.near).all()
        if len(self.near) > _LARGE * len(wanted) or not held:
            near = wanted if start is None else np.union1d(self._nodes_within(pose, _REACH + _SPARE), touched)
            self._rows = self._rows_of(near)

    def _rows_of(self, near: np.ndarray) -> Rows:
        return ComplianceRows(self.compliance, near)

    def _nodes_within(self, pose: Pose, reach: float) -> np.ndarray:
        """Return sorted positions (k,) in ``touchable`` of resting nodes less than ``reach`` m outside the indenter."""
        nodes, _ = self.compliance.surface.blocks.near(self.indenter, pose, reach)
        touchable = self.compliance.touchable
        return np.searchsorted(touchable, nodes[among(nodes, touchable)])

    @property
    def near(self) -> np.ndarray:
        """Sorted positions (n,) in ``compliance.touchable`` of nodes near the indenter: each solve checks them."""
        return self._rows.near

    @property
    def nodes_near(self) -> np.ndarray:
        """Nodes (n,), by position in ``touchable``: ``near`` without the points between nodes of a subclass."""
        return self.near

    def _walk(self, pose: Pose, axial_force: float | None, start: Contact | None) -> Contact:
        """Solve in one step or, if that does not converge, in 4, 9 or 20. axial_force : N, None for the pose's depth"""
        contact = self._solve(pose, axial_force, start)
        for steps in _DETOURS:
            if contact.converged:
                break
            contact = self._steps(pose, axial_force, start, steps)
        return contact

    def _steps(self, pose: Pose, axial_force: float | None, start: Contact | None, steps: int) -> Contact:
        """Go from ``start`` (None: rest) to the goal in equal steps. axial_force : N, None for the pose's depth"""
        first = contact = start or self._nothing(self.pose)
        for share in np.arange(1, steps + 1) / steps:
            goal = None if axial_force is None else first.axial_force + share * (axial_force - first.axial_force)
            there = between(first.pose, pose, share)
            if axial_force is not None and same_place(first.pose, pose):
                there = contact.pose  # only the force grows: each step starts as deep as the last one ended
            contact = self._solve(there, goal, contact)
        return contact

    def _solve(self, pose: Pose, axial_force: float | None, start: Contact | None) -> Contact:
        """Solve in one step: choose nodes to begin with, run ``_rounds``. axial_force : N, None for the pose's depth"""
        before = start or self._nothing(self.pose)
        moved = self._moved(before)
        gap, _ = self._distance(pose, self.near, moved)
        touched = np.zeros(len(gap), bool)
        touched[np.searchsorted(self.near, before.nodes)] = True
        touched &= gap < _REACH
        take = (gap < _way_in(before, axial_force)) | touched
        if not take.any():
            lost = len(before.nodes) > 0 and self._overlaps_at_rest(pose)  # left behind, and yet not out of reach
            return self._nothing(pose, converged=axial_force is None and not lost)
        active = touched[take] | (gap[take] < min(_LIKELY * gap.min(), 0))
        far = 0.1e-3 + float(np.linalg.norm(pose.apex - before.pose.apex))
        landed, inside = moved[take], gap[take] < -_CLOSED
        if inside.any():
            landed[inside] += project(self.indenter, pose, self._rest[self.near[take][inside]] + landed[inside], far)
        candidates = Candidates(
            self.near[take], landed, np.zeros_like(landed), active, before.core_nodes, np.zeros(len(active), int)
        )
        return self._rounds(pose, axial_force, before, moved, candidates)

    def _overlaps_at_rest(self, pose: Pose) -> bool:
        """Return true if the undeformed surface would touch the indenter."""
        return bool((self._distance(pose, self.near, np.zeros((len(self.near), 3)))[0] < 0).any())

    def _distance(self, pose: Pose, nodes: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gaps (k,) m and normals (k, 3) of the indenter at nodes (k,) that have moved by (k, 3) m."""
        return pose.distance(self.indenter, self._rest[nodes] + moved)

    def _moved(self, contact: Contact) -> np.ndarray:
        """Return the displacement (n, 3) m of the near nodes in a contact."""
        return self._rows.moved(contact.nodes, contact.nodal_force, contact.core_nodes, contact.core_force)

    def _rounds(self, pose: Pose, axial_force: float | None, before: Contact, moved, candidates: Candidates) -> Contact:  # noqa: ANN001
        """Solve, and add the near nodes that the solution lets through the indenter or the core, until there are none.
        axial_force : N, None for the pose's depth; before : last contact; moved : (n, 3) m, of the near nodes in it"""
        iterations, shift = 0, 0.0
        contact = self._nothing(pose)  # where every round found creases
        for _ in range(_MOST_ROUNDS):
            state = self._iterate(pose, axial_force, before, moved, candidates, shift)
            if state is None:
                return self._nothing(pose, iterations=iterations + 1, converged=False)
            iterations, shift = iterations + state.iterations, state.shift
            candidates.go_on(state.displacement, state.active)
            there, rest = pose.moved(shift), self._rest[candidates.nodes]
            if state.creases is not None:
                candidates.split(*state.creases, self.indenter, there, rest)
                continue
            contact, around = self._result(there, state, candidates, iterations)
            if not state.settled or not self._take_in(candidates, around):
                return contact
        return dataclasses.replace(contact, converged=False)

    def _iterate(self, pose, axial_force, before, moved, candidates, shift) -> Try | None:  # noqa: ANN001
        """Solve for candidates, with friction or without; None if that fails. Arguments as in ``_rounds``."""
        self.work.check()
        block = self._block
        if block is None or not (
            np.array_equal(block.nodes, candidates.nodes) and np.array_equal(block.inner, candidates.inner)
        ):
            block = self._block = ComplianceBlock(self.compliance, candidates.nodes, candidates.inner, self._rows)
        rest = self._rest[candidates.nodes]
        active = np.r_[candidates.active, np.ones(block.c, bool)]
        begin = Try(candidates.displacement, np.zeros_like(rest), np.zeros(block.c), shift, active)
        core_gap = self.compliance.watch_gap[candidates.inner].astype(float)
        if self.friction == 0:
            solver: Frictionless | Friction = self._frictionless(block, rest, core_gap, pose, candidates)
        else:
            begin.force, begin.slipping = borne(before, candidates.nodes)
            spots = self._spots(before, moved, pose, candidates.nodes)
            solver = Friction(block, rest, core_gap, self.indenter, pose, spots, self.friction, self._stiffness)
        unknowns = len(active) if self.friction == 0 else len(block.matrix)
        try:
            found = solver.solve(begin, axial_force)
        except UnsolvedError:
            self.work.spend(unknowns, _FAILS_AFTER)
            return None
        self.work.spend(unknowns, found.iterations)
        return found

    def _frictionless(
        self, block: ComplianceBlock, rest: np.ndarray, core_gap: np.ndarray, pose: Pose, candidates: Candidates
    ) -> Frictionless:
        return Frictionless(block, rest, core_gap, self.indenter, pose, candidates.probe, candidates.faced)

    def _spots(self, before: Contact, moved: np.ndarray, pose: Pose, nodes: np.ndarray) -> np.ndarray:
        """Return the points (k, 3) m, in the indenter's frame, that nodes (k,) stick to: those of before, or where they
        first meet it. moved : (n, 3) m, displacement of all near nodes in the contact before"""
        points = self._rest[nodes] + moved[np.searchsorted(self.near, nodes)]
        spots, new = before.pose.to_own(points), ~among(nodes, before.nodes)
        if pose is not before.pose:
            spots[new] = first_contact(self.indenter, spots[new], pose.to_own(points[new]))
        return spots

    def _take_in(self, candidates: Candidates, around: _Around) -> bool:
        """Make candidates of nodes that the contact lets through indenter or core; return true if there are any."""
        outside = np.ones(len(self.near), bool)
        outside[np.searchsorted(self.near, candidates.nodes)] = False
        found = bool(around.gap[outside].min(initial=0.0) < -_CLOSED)
        if found:
            new = outside & (around.gap < _TAKE_IN)
            candidates.add(self.near[new], around.moved[new], np.zeros((int(new.sum()), 3)))
        if around.core_gap.min(initial=0.0) < -_CLOSED:
            close = self.compliance.feet + np.flatnonzero(around.core_gap < _CORE_TAKE_IN)
            inner = np.union1d(candidates.inner, close)
            found |= len(inner) > len(candidates.inner)
            candidates.inner = inner
        return found

    def _nothing(self, pose: Pose, *, converged: bool = True, iterations: int = 0) -> Contact:
        """Return a contact without force at a pose; ``converged`` false: none was found, after so many iterations."""
        none, depth = np.empty(0, int), float((pose.apex - self.pose.apex) @ pose.direction)
        return Contact(
            self.compliance, pose, depth, np.zeros(3), 0.0, none, np.zeros((0, 3)), np.zeros(0, bool), converged,
            iterations, none, np.zeros(0), 0.0, 0.0,
        )  # fmt: skip

    def _result(self, pose: Pose, state: Try, candidates: Candidates, iterations: int) -> tuple[Contact, _Around]:
        touching, pressed, slips = _single(candidates.nodes, state)
        nodes, force, slipping = self._on_nodes(touching, pressed, slips)
        presses = state.core_force > 0
        inner, inner_force = candidates.inner[presses], state.core_force[presses]
        moved = self._place(touching, pressed, self._rows.moved(nodes, force, inner, inner_force))
        gap, normal = self._distance(pose, self.near, moved)
        sideways = sideways_share(pressed, normal[np.searchsorted(self.near, touching)])
        over_core = self.compliance.feet + self.compliance.facing
        gaps = sensing_gaps(self.compliance, nodes, force, inner, inner_force, over_core)
        core = gaps[self.compliance.feet :]
        penetration = max(-float(gap.min(initial=0.0)), -float(core.min(initial=0.0)))
        total = force.sum(axis=0)
        contact = Contact(
            self.compliance, pose, float((pose.apex - self.pose.apex) @ pose.direction), total,
            float(total @ pose.direction), nodes, force, slipping, state.settled and penetration <= PENETRATION,
            iterations, inner, inner_force, penetration, sideways,
        )  # fmt: skip
        return contact, _Around(moved, gap, core)

    def _on_nodes(self, touching: np.ndarray, force: np.ndarray, slipping: np.ndarray) -> Loads:
        """Return the nodes (j,) that carry force (k, 3) N on points ``touching`` (k,), the forces (j, 3) N, and which
        are slipping (j,). Here they are the points themselves."""
        return touching, force, slipping

    def _place(self, touching: np.ndarray, force: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Return the displacement (n, 3) m of all points near, given the surface's there, moved (n, 3) m. Here it is
        that; ``EdgeContactProblem`` adds how force (k, 3) N compresses springs at points ``touching`` (k,)."""
        return moved


def _single(nodes: np.ndarray, state: Try) -> Loads:
    """Return those of nodes (k,) that carry force, each once, their forces (j, 3) N, and which of them slip (j,)."""
    force, slipping = state.force, state.slipping
    if (nodes[1:] == nodes[:-1]).any():
        first = np.flatnonzero(np.diff(nodes, prepend=-1))
        nodes, force, slipping = nodes[first], np.add.reduceat(force, first), slipping[first]
    carries = force.any(axis=1)
    return nodes[carries], force[carries], slipping[carries]


def _way_in(before: Contact, axial_force: float | None) -> float:
    """Estimate how much deeper, m, an indenter goes as its force grows from ``before`` to axial_force N (Hertz)."""
    if axial_force is None or before.axial_force <= 0 or before.depth <= 0:
        return 0.0
    return min(before.depth * max((axial_force / before.axial_force) ** (2 / 3) - 1, 0.0), _REACH / 2)
