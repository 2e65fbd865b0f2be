"""Contact with Coulomb friction: nodes stick to the spot of the indenter where they landed until friction is spent.

Newton's method on all forces at once, normal and tangential ones. Which points touch and which slip follows from each
step: a semi-smooth Newton method (``coulomb``, ``newton_step``).
"""

from __future__ import annotations

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ...geometry.indenters.indenter import lengths
from . import coulomb, newton_step
from .active_set import UnsolvedError
from .compliance_rows import ComplianceBlock
from .contact_stiffness import ContactStiffness
from .frictionless import AXIAL_TOLERANCE, GAP_TOLERANCE, SIDEWAYS_TOLERANCE, Pace, Try

MAX_ITERATIONS = 24  # most contacts take 3 to 7; smaller steps help those that do not settle
LARGEST_STEP = 0.25e-3  # m, of the depth in one iteration
# Share of a contact's friction by which a node that keeps changing between stick and slip may pass its limit: at an
# edge it may slip backward as soon as it slips, and a detour for it takes ten times as long and seldom helps.
WAVERING = 5e-3
NEARLY_CLOSED = 5e-6  # m, largest gap with which Newton's step lets normals turn: it misleads at edges (assumed)
FLAT = np.empty(0, int), np.empty((0, 3, 3))  # no node feels the curvature
_MOST_CURVED, _FEELS_CURVATURE = 20, 0.1  # most nodes, least curvature x force x compliance, as without friction


class Friction:
    """Solver for the k nodes and c points over the core of one ``ComplianceBlock``.
    rest : (k, 3) m, the nodes at rest; core_gap : (c,) m, without forces; pose : of the indenter at shift 0
    spots : (k, 3) m, points that nodes stick to, in the indenter's frame; friction : Coulomb's coefficient
    stiffness : inverse that the previous solve, of any block, left behind; this one updates it"""

    def __init__(
        self, block: ComplianceBlock, rest: np.ndarray, core_gap: np.ndarray, indenter: Indenter, pose: Pose,
        spots: np.ndarray, friction: float, stiffness: ContactStiffness,
    ) -> None:  # fmt: skip
        self.block, self.rest, self.core_gap, self.stiffness = block, rest, core_gap, stiffness
        self.indenter, self.pose, self.spots, self.friction = indenter, pose, spots, friction

    def solve(self, begin: Try, axial_force: float | None) -> Try:
        """Solve from the first guess ``begin``: the contact at ``pose``, moved by the guess's shift, or, if
        ``axial_force`` is given, at that force, N along the motion.
        The result is not ``settled`` if iterations run out or stall. Raises UnsolvedError if a step fails."""
        k = self.block.k
        force, core, shift = np.ascontiguousarray(begin.force), begin.core_force, begin.shift
        active, slips = begin.active.copy(), begin.slipping.copy()
        place, pace, calm = begin.displacement, Pace(), False
        left, stuck_again = np.zeros(k, bool), np.zeros(k, np.int64)
        there = self.pose.moved(shift)
        gap, normal, off = self._look(place, there)
        for iteration in range(1, MAX_ITERATIONS + 1):
            force, core = force.copy(), core.copy()  # the iterate before keeps its own
            lean = coulomb.reduce_to_law(force, core, active, slips, normal, self.friction)
            moved, core_moved = self.block.respond(force, core)
            motion = coulomb.motion_from(place, moved, off, gap, normal)
            before = coulomb.Points(force, core, active, slips, normal, lean, gap, self.core_gap + core_moved, off)
            curves = self._bend(before, place, there) if calm else FLAT
            force, core, step = self._step(before, motion, curves, axial_force)
            if axial_force is not None:
                shift += step
                there = self.pose.moved(shift)
            displacement, core_moved = self.block.respond(force, core)
            gap, turned, off = self._look(displacement, there)
            state = Try(displacement, force.copy(), core, shift, active, iterations=iteration, slipping=slips)
            after = coulomb.Points(force, core, active, slips, normal, lean, gap, self.core_gap + core_moved, off)
            axial = float(force.sum(axis=0) @ self.pose.direction)
            # What a node may bear beyond its friction's limit, N, that alternates between stick and slip.
            spare = max(WAVERING * self.friction * abs(axial), coulomb.FORCE_NOISE)
            law = coulomb.Law(self.friction, spare, GAP_TOLERANCE)
            found = coulomb.sort_points(after, turned, stuck_again, law)
            in_place = _in_place(found, may_be_empty=axial_force is None)
            bears = axial_force is None or abs(axial - axial_force) <= AXIAL_TOLERANCE * abs(axial_force)
            state.settled = in_place and bears
            if state.settled:
                return state
            open_gap = 0.0 if in_place else coulomb.come_back(after, found, turned, left, self.friction)
            active, slips = found.active, found.slips
            calm = not found.changed and open_gap < NEARLY_CLOSED
            trust = pace.after_wrong(0.0 if in_place else max(-found.deepest, open_gap))
            if pace.stalled:
                break
            if trust == 1:
                place, normal = displacement, turned
                continue
            place = place + trust * (displacement - place)
            gap, normal, off = self._look(place, there)
        return state

    def _look(self, place: np.ndarray, there: Pose) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gaps (k,) m, normals (k, 3), offsets (k, 3) m from spots, of nodes displaced by place (k, 3) m."""
        points = self.rest + place
        gap, normal = there.distance(self.indenter, points)
        return gap, normal, points - there.from_own(self.spots)

    def _bend(self, points: coulomb.Points, place: np.ndarray, there: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Find the slipping nodes most affected by the indenter's curvature: (q,) positions among these, and the
        distance's second derivatives (q, 3, 3) 1/m. place : (k, 3) m, nodes' displacement; there : the indenter's pose
        """
        at = np.flatnonzero(points.slips & points.active[: self.block.k])
        if not len(at):
            return FLAT
        found = there.curvature(self.indenter, self.rest[at] + place[at])
        feels = lengths(points.force[at]) * self.block.matrix.diagonal()[3 * at] * lengths(found.reshape(-1, 9))
        felt = np.argsort(-feels, kind="stable")[:_MOST_CURVED]
        felt = np.sort(felt[feels[felt] > _FEELS_CURVATURE])
        return felt, found[felt]

    def _step(
        self, points: coulomb.Points, motion: coulomb.Motion, curves: tuple[np.ndarray, np.ndarray],
        axial_force: float | None,
    ) -> tuple[np.ndarray, np.ndarray, float]:  # fmt: skip
        """Return forces (k, 3), (c,) N that close gaps and hold sticking nodes, and the indenter's travel, m.
        curves : of ``_bend``; axial_force : N to reach, None if the indenter stays"""
        at = np.flatnonzero(points.slips & points.active[: self.block.k])
        slipping = coulomb.slipping_nodes(at, points, motion, *curves, self.friction)
        stiffness, direction = self.stiffness.among(self.block, points.active), self.pose.direction
        change = newton_step.change_of(stiffness, points, motion, slipping, direction, deepens=axial_force is not None)
        step = 0.0 if axial_force is None else self._step_for(change.forces, points.force, axial_force)
        force, core = newton_step.advance(points.force, points.core, change, step, slipping)
        return force, core, step

    def _step_for(self, change: np.ndarray, force: np.ndarray, axial_force: float) -> float:
        """Return the indenter's travel, m, in a step to axial_force, N. UnsolvedError if travel does not raise it.

        change : (3 k + c, 2) N, of forces without travel, and per metre of it; force : (k, 3) N before the step"""
        changed = change[: force.size].reshape(-1, 3, 2).sum(axis=0)
        carried, per_step = self.pose.direction @ changed
        if not per_step > 0:
            raise UnsolvedError("no node can carry the force")
        step = (axial_force - float(force.sum(axis=0) @ self.pose.direction) - carried) / per_step
        return min(max(float(step), -LARGEST_STEP), LARGEST_STEP)


def _in_place(found: coulomb.Sorted, *, may_be_empty: bool) -> bool:
    """Return true if nodes are where they belong: gaps closed, sticking ones at their spots, forces along normals."""
    return bool(
        not found.changed
        and (found.touched or may_be_empty)
        and found.deepest >= -GAP_TOLERANCE
        and found.widest <= GAP_TOLERANCE
        and found.slid <= coulomb.SLIP_TOLERANCE
        and found.tilted <= SIDEWAYS_TOLERANCE * found.size
    )
