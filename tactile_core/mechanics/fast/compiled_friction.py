"""The friction solver with its loops compiled: the same method, a tenth of the calls."""

from __future__ import annotations

import numpy as np

from . import friction_loops as loops
from .friction import (
    BEYOND,
    FLAT,
    GAP_NOISE,
    MAX_ITERATIONS,
    NEARLY_CLOSED,
    SLIP_TOLERANCE,
    WAVERS,
    Friction,
)
from .frictionless import FORCE_TOLERANCE, GAP_TOLERANCE, SIDEWAYS_TOLERANCE, Pace, Try
from .stick_slip import LARGEST_TILT, LARGEST_TURN, LEAST_FORCE, solved


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
            at = np.flatnonzero(slips & active[:k])
            curved, bend = self._bend_at(at, force, place, there) if calm else FLAT
            force, core, step = self._newton(
                force, core, active, at, normal, lean, slip, gap_then, self.core_gap + core_moved, moves, curved, bend,
                axial_force,
            )  # fmt: skip
            if axial_force is not None:
                shift += step
                there = self.pose.moved(shift)
            displacement, core_moved = loops.respond(matrix, force, core)
            points = self.rest + displacement
            (gap, turned), off = there.distance(self.indenter, points), self._off(points, there)
            state = Try(displacement, force.copy(), core, shift, active, iterations=iteration, slipping=slips)
            active, slips, changed, settled, widest, wrong = loops.sort(
                force, core, active, slips, normal, lean, off, gap, self.core_gap + core_moved, turned, stuck_again,
                left, self.friction, LEAST_FORCE, GAP_NOISE, GAP_TOLERANCE, SLIP_TOLERANCE, SIDEWAYS_TOLERANCE, BEYOND,
                self._spare(force), WAVERS, axial_force is None,
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

    def _newton(  # noqa: ANN202
        self, force, core, active, at, normal, lean, slip, gap, core_gap, moves, curved, bend, axial_force,  # noqa: ANN001
    ):  # fmt: skip
        """See ``stick_slip.Step``: forces (k, 3), (c,) N after the step, and how far the indenter moves, m."""
        inverse, rows = self.stiffness.among(self.block, active)
        direction, friction, columns = self.pose.direction, self.friction, 1 if axial_force is None else 2
        across, pressing, limit, against, turning = loops.slipping_frames(
            at, normal, lean, force, slip, curved, bend, friction, LEAST_FORCE
        )
        motion = loops.known_motion(active, slip, gap, normal, lean, core_gap, at, direction, columns)
        forces = loops.moving_forces(inverse, rows, motion)
        bearing, moved = loops.borne(forces, motion, moves, at, curved, turning, direction)
        turns = np.empty((0, columns))
        if len(at):
            system, right = loops.slip_system(
                inverse, rows, len(motion), at, normal, lean, across, against, curved, turning, bearing, friction
            )
            answer = np.ascontiguousarray(solved(system, right))
            turns = answer[len(at) :]
            loops.slide(motion, answer, at, lean, across, against)
            forces = loops.moving_forces(inverse, rows, motion)
            bearing, moved = loops.borne(forces, motion, moves, at, curved, turning, direction)
        step = 0.0 if axial_force is None else self._step_for(forces, force, axial_force)
        force, core = loops.advance(
            force, core, forces, step, at, normal, lean, across, pressing, limit, curved, bend, bearing, moved,
            turns, friction, LARGEST_TURN, LARGEST_TILT,
        )  # fmt: skip
        return force, core, step


def _bears(force: np.ndarray, direction: np.ndarray, axial_force: float) -> bool:
    return abs(float(force.sum(axis=0) @ direction) - axial_force) <= FORCE_TOLERANCE * abs(axial_force)
