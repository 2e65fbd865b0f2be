"""The friction solver with its loops compiled: the same method, a tenth of the calls."""

from __future__ import annotations

import numpy as np

from . import friction_loops as loops
from . import stick_slip
from .active_set import UnsolvedError
from .friction import (
    BEYOND,
    BEYOND_WAVERING,
    FLAT,
    GAP_NOISE,
    LARGEST_STEP,
    MAX_ITERATIONS,
    NEARLY_CLOSED,
    SLIP_TOLERANCE,
    WAVERS,
    Friction,
)
from .frictionless import FORCE_TOLERANCE, GAP_TOLERANCE, SIDEWAYS_TOLERANCE, Pace, Try
from .stick_slip import LEAST_FORCE


class CompiledFriction(Friction):
    """``Friction`` whose iteration, ``solve``, is compiled."""

    def solve(self, begin: Try, axial_force: float | None) -> Try:
        """See ``Friction.solve``."""
        k, direction, matrix = self.block.k, self.pose.direction, self.block.matrix
        force, core, shift = np.ascontiguousarray(begin.force), begin.core_force, begin.shift
        active, slips = begin.active.copy(), begin.slipping.copy()
        place, pace, calm = begin.displacement, Pace(), False
        left, stuck_again = np.zeros(k, bool), np.zeros(k, np.int64)
        lean, moves, slip, gap_then = np.empty((k, 3)), np.empty((k, 3)), np.empty((k, 3)), np.empty(k)
        there = self.pose.moved(shift)
        points = self.rest + place
        (gap, normal), off = there.distance(self.indenter, points), self._off(points, there)
        for iteration in range(1, MAX_ITERATIONS + 1):
            force, core = force.copy(), core.copy()  # the iterate before keeps its own
            loops.reduce_to_law(force, core, active, slips, normal, self.friction, lean)
            moved, core_moved = loops.respond(matrix, force, core)
            loops.linearise(moved, place, off, gap, normal, moves, slip, gap_then)
            at, core_at = np.flatnonzero(active[:k]), np.flatnonzero(active[k:])
            sliding = slips[at]
            stuck, slipping = at[~sliding], at[sliding]
            curved, bend = self._bend_at(slipping, force, place, there) if calm else FLAT
            system, right, carry, across, pressing = loops.assemble(
                matrix, k, stuck, core_at, slipping, normal, lean, force, slip, gap_then, self.core_gap + core_moved,
                moves, curved, bend, direction, self.friction, stick_slip.RIDGE, LEAST_FORCE,
            )  # fmt: skip
            answer = stick_slip.solved(system, right, symmetric=not len(slipping))
            step = 0.0
            if axial_force is not None:
                step = _step_for(axial_force - float(force.sum(axis=0) @ direction), carry, answer)
                shift += step
                there = self.pose.moved(shift)
            force, core = loops.advance(
                force, core, np.ascontiguousarray(answer), step, stuck, core_at, slipping, normal, lean, across,
                pressing, curved, bend, self.friction, LEAST_FORCE, stick_slip.LARGEST_TURN, stick_slip.LARGEST_TILT,
            )  # fmt: skip
            displacement, core_moved = loops.respond(matrix, force, core)
            points = self.rest + displacement
            (gap, turned), off = there.distance(self.indenter, points), self._off(points, there)
            state = Try(displacement, force.copy(), core, shift, active, iterations=iteration, slipping=slips)
            active, slips, changed, settled, widest, wrong = loops.sort(
                force, core, active, slips, normal, lean, off, gap, self.core_gap + core_moved, turned, stuck_again,
                left, self.friction, LEAST_FORCE, GAP_NOISE, GAP_TOLERANCE, SLIP_TOLERANCE, SIDEWAYS_TOLERANCE, BEYOND,
                BEYOND_WAVERING, WAVERS, axial_force is None,
            )  # fmt: skip
            state.settled = settled and (axial_force is None or _bears(force, direction, axial_force))
            if state.settled:
                return state
            calm = not changed and widest < NEARLY_CLOSED
            trust = pace.after_wrong(wrong)
            if pace.stalled:
                break
            if trust == 1:
                place, normal = displacement, turned
                continue
            place = place + trust * (displacement - place)
            points = self.rest + place
            (gap, normal), off = there.distance(self.indenter, points), self._off(points, there)
        return state


def _step_for(missing: float, carry: np.ndarray, answer: np.ndarray) -> float:
    """Distance, m, that the indenter moves for ``missing`` N more along its motion. Raises UnsolvedError."""
    carried, per_step = carry @ answer
    if not per_step > 0:
        raise UnsolvedError("no node can carry the force")
    return min(max(float((missing - carried) / per_step), -LARGEST_STEP), LARGEST_STEP)


def _bears(force: np.ndarray, direction: np.ndarray, axial_force: float) -> bool:
    return abs(float(force.sum(axis=0) @ direction) - axial_force) <= FORCE_TOLERANCE * abs(axial_force)
