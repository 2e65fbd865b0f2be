"""Contact with Coulomb friction: nodes stick to the spot of the indenter where they landed until friction is spent.

Newton's method on all forces at once, normal and tangential ones. Which points touch and which slip follows from each
step: a semi-smooth Newton method. P. Alart, A. Curnier, Computer Methods in Applied Mechanics and Engineering 92, 1991,
353-375.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ...geometry.indenters.indenter import lengths
from ...geometry.node_vectors import dot
from .active_set import UnsolvedError
from .compliance_block import ComplianceBlock
from .contact_stiffness import ContactStiffness
from .frictionless import FORCE_TOLERANCE, GAP_TOLERANCE, SIDEWAYS_TOLERANCE, Pace, Try
from .stick_slip import LEAST_FORCE, Slipping, Step

SLIP_TOLERANCE = 0.05e-6  # m, motion of a sticking node that counts as none: a quarter of the gaps' tolerance
MAX_ITERATIONS = 24  # most contacts take 3 to 7; smaller steps help those that do not settle
LARGEST_STEP = 0.25e-3  # m, of the depth in one iteration
GAP_NOISE = 1e-9  # m: below what single precision of the compliance resolves
BEYOND = 1e-9  # relative, by which a sticking force may pass its limit before the node slips
# Share of a contact's friction by which a node that has stuck again so often may pass its limit: at an edge a node may
# slip backward as soon as it slips, and a detour for its sake takes ten times as long, and seldom leads nearer.
WAVERING, WAVERS = 5e-3, 2
NEARLY_CLOSED = 5e-6  # m, assumed: with larger gaps Newton's step in turning normals leads astray at edges
FLAT = np.empty(0, int), np.empty((0, 3, 3))  # no node feels the curvature
_MOST_CURVED, _FEELS_CURVATURE = 20, 0.1  # as without friction: nodes, and curvature x force x compliance


@dataclasses.dataclass
class _Guess:
    """Forces (k, 3), (c,) N, which points (k + c,) carry them, which nodes (k,) slip, and the shift, m."""

    force: np.ndarray
    core: np.ndarray
    active: np.ndarray
    slips: np.ndarray
    shift: float


@dataclasses.dataclass(frozen=True)
class _Seen:
    """Effect of guessed forces, linearised about a place (k, 3) m: gaps (k,) m at nodes and (c,) m at the core.

    normal, lean : (k, 3), of the indenter and of slipping nodes' friction; slip : (k, 3) m, from the spots
    moves : (k, 3) m, from the place; curved, bend : of the slipping nodes, see ``Slipping``
    """

    normal: np.ndarray
    lean: np.ndarray
    slip: np.ndarray
    gap: np.ndarray
    core_gap: np.ndarray
    moves: np.ndarray
    curved: np.ndarray
    bend: np.ndarray


class Friction:
    """Solves for the nodes of one block.

    rest : (k, 3) m; core_gap : (c,) m; spots : (k, 3) m, where nodes stick, in the indenter's frame
    stiffness : that of the solve before, of whichever block, from which this one goes on
    """

    def __init__(
        self, block: ComplianceBlock, rest: np.ndarray, core_gap: np.ndarray, indenter: Indenter, pose: Pose,
        spots: np.ndarray, friction: float, stiffness: ContactStiffness | None = None,
    ) -> None:  # fmt: skip
        self.block, self.rest, self.core_gap = block, rest, core_gap
        self.stiffness = stiffness or ContactStiffness()
        self.indenter, self.pose, self.spots, self.friction = indenter, pose, spots, friction

    def solve(self, begin: Try, axial_force: float | None) -> Try:
        """Solve from a first guess for the contact at its depth, or at a force along the motion, N.

        Raises UnsolvedError.
        """
        guess = _Guess(begin.force, begin.core_force, begin.active, begin.slipping, begin.shift)
        state, place, pace, k = begin, begin.displacement, Pace(), self.block.k
        there, calm, left, stuck_again = self.pose.moved(guess.shift), False, np.zeros(k, bool), np.zeros(k, int)
        points = self.rest + place
        (gap, normal), off = there.distance(self.indenter, points), self._off(points, there)
        for iteration in range(1, MAX_ITERATIONS + 1):
            seen = self._evaluate_forces(guess, place, off, there, gap, normal, curved=calm)
            guess = self._step(guess, seen, axial_force)
            if axial_force is not None:
                there = self.pose.moved(guess.shift)
            displacement, core_moved = self.block.respond(guess.force, guess.core)
            points = self.rest + displacement
            (gap, turned), off = there.distance(self.indenter, points), self._off(points, there)
            slip = _across(off, normal)
            spare = np.where(stuck_again < WAVERS, LEAST_FORCE, self._spare(guess.force))
            active, slips, changed = self._sort(guess, seen, slip, gap, self.core_gap + core_moved, spare)
            stuck_again += guess.slips & ~slips & active[:k]
            state = Try(
                displacement, guess.force, guess.core, guess.shift, guess.active,
                iterations=iteration, slipping=guess.slips,
            )  # fmt: skip
            state.settled = not changed and self._settled(state, gap, slip, turned, normal, axial_force)
            if state.settled:
                return state
            back = left & active[:k] & ~guess.active[:k]
            left |= guess.active[:k] & ~active[:k]
            guess.active, guess.slips = active, slips
            self._come_back(guess, back, slip, turned)
            calm = not changed and bool(np.abs(gap[active[:k]]).max(initial=0.0) < NEARLY_CLOSED)
            trust = pace.after(gap, active[:k])
            if pace.stalled:
                break
            if trust == 1:
                place, normal = displacement, turned
                continue
            place = place + trust * (displacement - place)
            points = self.rest + place
            (gap, normal), off = there.distance(self.indenter, points), self._off(points, there)
        return state

    def _evaluate_forces(self, guess: _Guess, place, off, there: Pose, gap, normal, *, curved: bool) -> _Seen:  # noqa: ANN001
        """Effect of the forces after reduction to Coulomb's law at the normals (k, 3) of the place (k, 3) m."""
        k = self.block.k
        guess.force = np.where(guess.active[:k, None], guess.force, 0.0)
        guess.core = np.where(guess.active[k:], np.maximum(guess.core, 0), 0.0)
        lean = np.zeros((k, 3))
        if guess.slips.any():
            s = np.flatnonzero(guess.slips)
            pressing = dot(guess.force[s], normal[s])
            leans = guess.force[s] - pressing[:, None] * normal[s]
            long = lengths(leans)
            if long.min() == 0:
                guess.slips[s[long == 0]] = False
                s, pressing, leans, long = (each[long > 0] for each in (s, pressing, leans, long))
            leans /= long[:, None]
            lean[s] = leans
            guess.force[s] = np.maximum(pressing, 0.0)[:, None] * (normal[s] + self.friction * leans)
        moved, core_moved = self.block.respond(guess.force, guess.core)
        moves = moved - place
        onto = dot(normal, moves)
        slip = _across(off, normal) + moves - onto[:, None] * normal
        bend = self._bend(guess, place, there) if curved else FLAT
        return _Seen(normal, lean, slip, gap + onto, self.core_gap + core_moved, moves, *bend)

    def _off(self, points: np.ndarray, there: Pose) -> np.ndarray:
        """Offset of points (k, 3) m from their sticking points."""
        return points - there.from_own(self.spots)

    def _bend(self, guess: _Guess, place: np.ndarray, there: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Find the slipping nodes (c,) most affected by the indenter's curvature, and that curvature (c, 3, 3) 1/m."""
        return self._bend_at(np.flatnonzero(guess.slips), guess.force, place, there)

    def _bend_at(
        self, at: np.ndarray, force: np.ndarray, place: np.ndarray, there: Pose
    ) -> tuple[np.ndarray, np.ndarray]:
        if not len(at):
            return FLAT
        found = there.curvature(self.indenter, self.rest[at] + place[at])
        feels = lengths(force[at]) * self.block.matrix.diagonal()[3 * at] * lengths(found.reshape(-1, 9))
        felt = np.argsort(-feels, kind="stable")[:_MOST_CURVED]
        felt = np.sort(felt[feels[felt] > _FEELS_CURVATURE])
        return felt, found[felt]

    def _step(self, guess: _Guess, seen: _Seen, axial_force: float | None) -> _Guess:
        """The forces with which linearised gaps close and sticking nodes stay, among what touches and slips now."""
        at = np.flatnonzero(guess.slips & guess.active[: self.block.k])
        slipping = Slipping(
            at, seen.normal[at], seen.lean[at], dot(guess.force[at], seen.normal[at]), seen.slip[at], seen.moves[at],
            seen.curved, seen.bend, self.friction,
        )  # fmt: skip
        away = seen.slip + seen.gap[:, None] * seen.normal
        solved = Step(
            self.stiffness, self.block, guess.active, away, seen.core_gap, self.pose.direction, slipping,
            deepens=axial_force is not None,
        )  # fmt: skip
        step = 0.0 if axial_force is None else self._step_for(solved.forces, guess.force, axial_force)
        force, core = solved.change(guess.force, guess.core, step)
        return _Guess(force, core, guess.active, guess.slips, guess.shift + step)

    def _step_for(self, change: np.ndarray, force: np.ndarray, axial_force: float) -> float:
        """Return how far, m, the indenter moves in a step. Raises UnsolvedError.

        change : (3 k + c, 2) N, of forces at rest and for a metre of motion; force : (k, 3) N before it
        """
        changed = change[: force.size].reshape(-1, 3, 2).sum(axis=0)
        carried, per_step = self.pose.direction @ changed
        if not per_step > 0:
            raise UnsolvedError("no node can carry the force")
        step = (axial_force - float(force.sum(axis=0) @ self.pose.direction) - carried) / per_step
        return min(max(float(step), -LARGEST_STEP), LARGEST_STEP)

    def _sort(self, guess: _Guess, seen: _Seen, slip, gap, core_gap, spare):  # noqa: ANN001, ANN202
        """Update which points (k + c,) touch and which nodes (k,) slip; returns true if either changed."""
        k = len(gap)
        pressing = dot(guess.force, seen.normal)
        opening = np.concatenate([gap, core_gap])
        active = np.where(guess.active, np.concatenate([pressing, guess.core]) >= -LEAST_FORCE, opening < -GAP_NOISE)
        held = active[:k] & guess.active[:k]
        over = lengths(guess.force - pressing[:, None] * seen.normal) > (
            self.friction * pressing * (1 + BEYOND) + spare
        )
        slips = held & np.where(guess.slips, dot(slip, seen.lean) <= SLIP_TOLERANCE, over)
        wrong = (guess.active & ~active).any() or (opening[~guess.active] < -GAP_TOLERANCE).any()
        return active, slips, bool(wrong or (slips != guess.slips)[held].any())

    def _spare(self, force: np.ndarray) -> float:
        """Friction, N, that a wavering node may bear beyond its limit, of forces (k, 3) N."""
        return max(WAVERING * self.friction * abs(float(force.sum(axis=0) @ self.pose.direction)), LEAST_FORCE)

    def _come_back(self, guess: _Guess, back: np.ndarray, slip: np.ndarray, normal: np.ndarray) -> None:
        """Let nodes (k,) bool that touch again slip: sticking drew them off the indenter before."""
        if not back.any():
            return
        far = lengths(slip)
        back = back & (far > 0)
        guess.force[back] = LEAST_FORCE * (normal[back] - self.friction * slip[back] / far[back, None])
        guess.slips = guess.slips | back

    def _settled(self, state: Try, gap, slip, turned, normal, axial_force) -> bool:  # noqa: ANN001
        active = state.active[: len(gap)]
        if not active.any():
            return bool((gap > -GAP_TOLERANCE).all()) and axial_force is None
        if gap.min() < -GAP_TOLERANCE or np.abs(gap[active]).max() > GAP_TOLERANCE:
            return False
        lean = np.where(state.slipping[:, None], _across(state.force, normal), 0.0)
        lean /= np.maximum(lengths(lean), 1e-30)[:, None]
        if lengths(slip - dot(slip, lean)[:, None] * lean)[active].max() > SLIP_TOLERANCE:
            return False
        whole = np.linalg.norm(state.force.sum(axis=0))
        if np.linalg.norm((turned - normal) * lengths(state.force)[:, None]) > SIDEWAYS_TOLERANCE * whole:
            return False
        axial = float(state.force.sum(0) @ self.pose.direction)
        return axial_force is None or abs(axial - axial_force) <= FORCE_TOLERANCE * abs(axial_force)


def _across(vectors: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Vectors (k, 3) without their part along ``normal`` (k, 3)."""
    return vectors - dot(vectors, normal)[:, None] * normal
