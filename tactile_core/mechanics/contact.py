"""Contact of a rigid indenter with a sensor's surface, solved on its compliance; every result is checked.

Only nodes that the indenter may touch enter a solve; the whole surface is then displaced and looked at, and nodes that
would go through the indenter, or inner skin that would go through the core, are taken in and the solve goes on.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..indenters import Indenter, Pose
from . import surface_answer
from .active_set import UnsolvedError
from .candidates import Candidates
from .compliance import Compliance
from .frictional import Frictional
from .frictionless import Frictionless, Try
from .landing import landing, meeting
from .near_block import NearBlock
from .pose_path import between, same_place

PENETRATION = 1e-6  # m, what MECHANICS allows at any node
_REACH = 0.8e-3  # m, nodes this far outside the indenter at the end of a solve may come to touch it
_TAKE_IN = 20e-6  # m: where some nodes go through the indenter, those this close to it are taken in with them
_CORE_TAKE_IN = 0.15e-3  # m, likewise for inner skin over the core, where gaps vary more
_CLOSED = 0.3e-6  # m: gaps closed to this need no further look
_MOST_ROUNDS = 12  # of taking in nodes
_DETOURS = (4, 8)  # steps from the start to the goal, where one does not settle
_LIKELY = 0.3  # nodes that overlap the indenter by this share of the deepest overlap are first taken to touch


@dataclasses.dataclass(frozen=True)
class Contact:
    """One solved contact. Lengths m, forces N, exerted by the indenter on the sensor.

    pose : where the indenter stands; depth : how far that is along the motion from the problem's pose
    force : (3,); axial_force : its part along the motion
    nodes : (k,) touchable indices that carry force; nodal_force : (k, 3)
    slipping : (k,) bool, nodes whose friction is spent; without friction all
    converged : whether it may be used; iterations : linearised problems solved for it
    displacement : (n, 3) float32, of the whole surface
    core_nodes : (c,) watched inner points that press on the core; core_force : (c,), on the skin, away from the core
    penetration : m, deepest place of a node in the indenter or of the inner skin in the core
    sideways : nodal forces across the indenter's normals over the whole force: 0 without friction
    """

    pose: Pose
    depth: float
    force: np.ndarray
    axial_force: float
    nodes: np.ndarray
    nodal_force: np.ndarray
    slipping: np.ndarray
    converged: bool
    iterations: int
    displacement: np.ndarray
    core_nodes: np.ndarray
    core_force: np.ndarray
    penetration: float
    sideways: float


class ContactProblem:
    """An indenter in front of one sensor; solves for depths, for forces along the motion, and for other poses.

    Nodes are followed only where the indenter can reach them, ``reach`` m in from the pose at depth 0.
    friction : Coulomb's coefficient; with it a contact depends on the one it goes on from, and on the steps between.
    """

    def __init__(
        self, compliance: Compliance, indenter: Indenter, pose: Pose, reach: float, friction: float = 0.0
    ) -> None:
        self.compliance, self.indenter, self.pose, self.friction = compliance, indenter, pose, friction
        self._rest = compliance.surface.rest[compliance.touchable]
        self._block: NearBlock | None = None
        self._look_near(pose.moved(reach))

    def at_depth(self, depth: float, start: Contact | None = None) -> Contact:
        """The contact at a given depth, m, going on from ``start`` where there is one."""
        return self._walk(self.pose.moved(depth), None, start)

    def at_force(self, axial_force: float, start: Contact) -> Contact:
        """The contact whose force along the motion is ``axial_force`` N, in or out from where ``start`` stands."""
        return self._walk(start.pose, axial_force, start)

    def at_pose(self, pose: Pose, start: Contact | None = None, axial_force: float | None = None) -> Contact:
        """The contact of the indenter at another pose, moved there from ``start`` in one step.

        axial_force : N; with it the indenter then moves along its own direction until it bears that force
        """
        self._look_near(pose)
        return self._walk(pose, axial_force, start)

    def _look_near(self, pose: Pose) -> None:
        gap, _ = pose.distance(self.indenter, self._rest)
        self.near = np.flatnonzero(gap < _REACH)

    def _walk(self, pose: Pose, axial_force: float | None, start: Contact | None) -> Contact:
        """Solve in one step, or where that does not settle by a detour."""
        contact = self._solve(pose, axial_force, start)
        for steps in _DETOURS:
            if contact.converged:
                break
            contact = self._steps(pose, axial_force, start, steps)
        return contact

    def _steps(self, pose: Pose, axial_force: float | None, start: Contact | None, steps: int) -> Contact:
        """Go from the start to the goal in several steps."""
        first = contact = start or self._nothing(self.pose)
        for share in np.arange(1, steps + 1) / steps:
            goal = None if axial_force is None else first.axial_force + share * (axial_force - first.axial_force)
            there = between(first.pose, pose, share)
            if axial_force is not None and same_place(first.pose, pose):
                there = contact.pose  # only the force grows: each step starts as deep as the last one ended
            contact = self._solve(there, goal, contact)
        return contact

    def _solve(self, pose: Pose, axial_force: float | None, start: Contact | None) -> Contact:
        before = start or self._nothing(self.pose)
        moved = before.displacement[self.compliance.touchable[self.near]].astype(float)
        gap, _ = pose.distance(self.indenter, self._rest[self.near] + moved)
        touched = np.isin(self.near, before.nodes)
        take = (gap < _way_in(before, axial_force)) | touched
        if not take.any():
            return self._nothing(pose, converged=axial_force is None)
        active = touched[take] | (gap[take] < min(_LIKELY * gap.min(), 0))
        far = 0.1e-3 + float(np.linalg.norm(pose.apex - before.pose.apex))
        landed = moved[take] + landing(self.indenter, pose, self._rest[self.near[take]] + moved[take], far)
        candidates = Candidates(
            self.near[take], landed, np.zeros_like(landed), active, before.core_nodes, np.zeros(len(active), bool)
        )
        return self._rounds(pose, axial_force, before, candidates)

    def _rounds(self, pose: Pose, axial_force: float | None, before: Contact, candidates: Candidates) -> Contact:
        """Solve, look at the whole surface, take in what it shows, until nothing more is found."""
        iterations, shift, contact = 0, 0.0, None
        for _ in range(_MOST_ROUNDS):
            state = self._iterate(pose, axial_force, before, candidates, shift)
            if state is None:
                return self._nothing(pose, iterations=iterations + 1, converged=False)
            iterations, shift = iterations + state.iterations, state.shift
            candidates.go_on(state.displacement, state.active)
            there, rest = pose.moved(shift), self._rest[candidates.nodes]
            if state.creases is not None:
                candidates.split(*state.creases, self.indenter, there, rest)
                continue
            contact = self._result(there, state, candidates, iterations)
            if not state.settled or not self._take_in(candidates, state, contact):
                return contact
        return dataclasses.replace(contact, converged=False)

    def _iterate(self, pose, axial_force, before, candidates, shift) -> Try | None:  # noqa: ANN001
        block = self._block
        if block is None or not (
            np.array_equal(block.nodes, candidates.nodes) and np.array_equal(block.inner, candidates.inner)
        ):
            block = self._block = NearBlock(self.compliance, candidates.nodes, candidates.inner)
        rest = self._rest[candidates.nodes]
        active = np.r_[candidates.active, np.ones(block.c, bool)]
        begin = Try(candidates.displacement, np.zeros_like(rest), np.zeros(block.c), shift, active)
        core_gap = self.compliance.watch_gap[candidates.inner].astype(float)
        if self.friction == 0:
            solver = Frictionless(block, rest, core_gap, self.indenter, pose, candidates.probe, candidates.faced)
        else:
            begin.force, begin.slipping = _borne(before, candidates.nodes)
            spots = self._spots(before, pose, candidates.nodes)
            solver = Frictional(block, rest, core_gap, self.indenter, pose, spots, self.friction)
        try:
            return solver.solve(begin, axial_force)
        except UnsolvedError:
            return None

    def _spots(self, before: Contact, pose: Pose, nodes: np.ndarray) -> np.ndarray:
        """Where nodes (k,) stick on the indenter, (k, 3) m in its frame: where they were, or where they meet it."""
        points = self._rest[nodes] + before.displacement[self.compliance.touchable[nodes]]
        spots, new = before.pose.to_own(points), np.isin(nodes, before.nodes, invert=True)
        spots[new] = meeting(self.indenter, spots[new], pose.to_own(points[new]))
        return spots

    def _take_in(self, candidates: Candidates, state: Try, contact: Contact) -> bool:
        """Let the nodes enter that the solved contact lets through the indenter or the core; whether there are any."""
        outside = np.setdiff1d(self.near, candidates.nodes, assume_unique=False)
        moved = contact.displacement[self.compliance.touchable[outside]].astype(float)
        gap, _ = contact.pose.distance(self.indenter, self._rest[outside] + moved)
        found = gap.min(initial=0.0) < -_CLOSED
        if found:
            new = gap < _TAKE_IN
            candidates.add(outside[new], moved[new], np.zeros_like(moved[new]))
        if len(self.compliance.watch_gap):
            core = watched_gaps(self.compliance, contact)[self.compliance.feet :]
            if core.min() < -_CLOSED:
                close = self.compliance.feet + np.flatnonzero(core < _CORE_TAKE_IN)
                inner = np.union1d(candidates.inner, close)
                found |= len(inner) > len(candidates.inner)
                candidates.inner = inner
        return bool(found)

    def _nothing(self, pose: Pose, *, converged: bool = True, iterations: int = 0) -> Contact:
        """No contact, or one that was not found."""
        still = np.zeros((len(self.compliance.surface.rest), 3), np.float32)
        none, depth = np.empty(0, int), float((pose.apex - self.pose.apex) @ pose.direction)
        return Contact(
            pose, depth, np.zeros(3), 0.0, none, np.zeros((0, 3)), np.zeros(0, bool), converged, iterations, still,
            none, np.zeros(0), 0.0, 0.0,
        )  # fmt: skip

    def _result(self, pose: Pose, state: Try, candidates: Candidates, iterations: int) -> Contact:
        nodes, first, merged = np.unique(candidates.nodes, return_index=True, return_inverse=True)
        force, slipping = np.zeros((len(nodes), 3)), state.slipping[first]
        np.add.at(force, merged, state.force)
        carries, presses = force.any(axis=1), state.core_force > 0
        nodes, force, slipping = nodes[carries], force[carries], slipping[carries]
        inner, inner_force = candidates.inner[presses], state.core_force[presses]
        displacement = surface_answer.displacement(self.compliance, nodes, force, inner, inner_force)
        total = force.sum(axis=0)
        placed = self._rest[self.near] + displacement[self.compliance.touchable[self.near]]
        gap, normal = pose.distance(self.indenter, placed)
        at = np.searchsorted(self.near, nodes)
        contact = Contact(
            pose, float((pose.apex - self.pose.apex) @ pose.direction), total, float(total @ pose.direction),
            nodes, force, slipping, state.settled, iterations, displacement, inner, inner_force,
            0.0, _sideways(force, normal[at]),
        )  # fmt: skip
        core = watched_gaps(self.compliance, contact)[self.compliance.feet :]
        penetration = max(-gap.min(initial=0.0), -core.min(initial=0.0))
        return dataclasses.replace(
            contact, penetration=float(penetration), converged=bool(state.settled and penetration <= PENETRATION)
        )


def _way_in(before: Contact, axial_force: float | None) -> float:
    """About how much deeper, m, an indenter will stand when its force grows from that of ``before``: Hertz's law."""
    if axial_force is None or before.axial_force <= 0 or before.depth <= 0:
        return 0.0
    return min(before.depth * max((axial_force / before.axial_force) ** (2 / 3) - 1, 0.0), _REACH / 2)


def _borne(before: Contact, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces (k, 3) N that nodes (k,) bore in a contact, and which of them slipped (k,)."""
    force, slipping = np.zeros((len(nodes), 3)), np.zeros(len(nodes), bool)
    same = np.isin(nodes, before.nodes)
    at = np.searchsorted(before.nodes, nodes[same])
    force[same], slipping[same] = before.nodal_force[at], before.slipping[at]
    return force, slipping


def _sideways(force: np.ndarray, normal: np.ndarray) -> float:
    size = np.linalg.norm(force.sum(axis=0))
    across = force - np.einsum("ai,ai->a", force, normal)[:, None] * normal
    return float(np.linalg.norm(across) / size) if size else 0.0


def surface_displacement(compliance: Compliance, contact: Contact) -> np.ndarray:
    """Displacement (n, 3) m of the whole surface in a contact."""
    return contact.displacement.astype(float)


def watched_gaps(compliance: Compliance, contact: Contact) -> np.ndarray:
    """Gaps (w,) m of the watched points in a contact: 19 electrodes, then inner skin over the core."""
    return surface_answer.watched_gaps(
        compliance, contact.nodes, contact.nodal_force, contact.core_nodes, contact.core_force
    )


def fluid_pressure(compliance: Compliance, contact: Contact) -> float:
    """Rise of the fluid's pressure in a contact, Pa."""
    at_nodes = compliance.pressure.reshape(-1, 3)[contact.nodes]
    at_core = compliance.inner_pressure[contact.core_nodes]
    return float((contact.nodal_force * at_nodes).sum() + contact.core_force @ at_core)
