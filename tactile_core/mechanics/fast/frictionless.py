"""Frictionless contact on a compliance: forces along the indenter's normals at the deformed surface.

Each iteration linearises the indenter's distance at the deformed nodes and solves the complementarity problem exactly.
Along edges and small balls the normals turn with the nodes, which the linearised problem does not see; the nodes that
feel it most take a Newton step in the tangent planes with the indenter's curvature.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from ...files.compiled import Loop
from ...geometry.indenters import Indenter, Pose
from ...geometry.indenters.indenter import lengths
from .active_set import Pressing, complement
from .compliance_rows import ComplianceBlock

GAP_TOLERANCE = 0.2e-6  # m: 1/5 of the 1 um penetration that the target allows
SIDEWAYS_TOLERANCE = 1e-4  # of the total force: what nodal forces may have across the normals where nodes end up
AXIAL_TOLERANCE = 1e-7  # relative, of the force along the motion where one is asked for
MAX_ITERATIONS = 60
_FEELS_CURVATURE = 0.1  # least curvature x force x compliance of a tangent direction in the Newton step
_FEELS_AT_ONCE, _LATER = 0.4, 5  # least such product before iteration 5: plain iterations are cheaper
# Limits of the Newton step's divisor, the second for modes that leave equilibrium (assumed, tried on random contacts).
_LEAST_STIFFNESS, _SLOPE_STIFFNESS = 0.02, 0.1
_LARGEST_TURN = 0.3  # rad, of a normal in one Newton step
_LARGEST_STEP = 0.25e-3  # m, of the depth in one iteration
_CREASE_ANGLE = np.cos(np.radians(20.0))
_CREASE_ITERATION = 6  # from which nodes that flip between two faces are taken to sit in the crease between them
_STALE = 0.1  # rad, turn of a normal above which the compliance along the normals is updated
_FEW = 0.3  # largest share of turned nodes whose part is updated; beyond it the whole costs less
_FREE_ITERATIONS = 4  # first iterations, in which steps are taken whole
# Assumed, tried on random contacts: iterations before a stall, those compared, and the decrease that is no stall.
_HOPE, _WINDOW, _NEARER = 4, 6, 0.5
_PROGRESS, _SHRINK, _GROW, _LEAST_TRUST = 0.8, 0.6, 1.3, 0.1


@dataclasses.dataclass
class Try:
    """Iterate of a solver for k surface nodes and c points over the core: displacement (k, 3) m, nodal force (k, 3) N,
    core_force (c,) N, and shift, m, of the indenter along its motion from the problem's pose.
    active : (k + c,) bool, which touch; settled : true if it fulfils the tolerances; iterations : so far
    slipping : (k,) bool, nodes whose friction is at its limit; without friction all
    creases : nodes (j,) that flip between two faces, points (j, 3) m and normals (j, 3) of the face left, or None"""

    displacement: np.ndarray
    force: np.ndarray
    core_force: np.ndarray
    shift: float
    active: np.ndarray
    settled: bool = False
    iterations: int = 0
    slipping: np.ndarray = dataclasses.field(default_factory=lambda: np.empty(0, bool))
    creases: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def __post_init__(self) -> None:
        if not len(self.slipping):  # without friction all nodes slip
            self.slipping = np.ones(len(self.displacement), bool)


class _Model(NamedTuple):
    """Compliance ``matrix`` (k + c, k + c) m/N of the gaps, along ``normal`` (k, 3) at nodes, and its Cholesky factors
    by active set."""

    normal: np.ndarray
    matrix: np.ndarray
    factors: dict[bytes, np.ndarray]


class Pace:
    """Step lengths of a solver: shorter while errors hardly fall, as when nodes at edges swing from side to side."""

    def __init__(self) -> None:
        self._trust, self._last, self._calls = 1.0, np.inf, 0
        self._best: list[float] = []  # m, least that was wrong in the first 1, 2, ... iterations

    @property
    def stalled(self) -> bool:
        """Return true if the last iterations have hardly reduced the error."""
        best = self._best
        return len(best) >= _HOPE + _WINDOW and best[-1] > _NEARER * best[-1 - _WINDOW]

    def after(self, gap: np.ndarray, active: np.ndarray) -> float:
        """Return the share, 0 to 1, of the next step to take. gap : (k,) m, which should be 0 where active (k,) bool"""
        return self.after_wrong(max(-gap.min(), np.abs(gap[active]).max(initial=0.0)))

    def after_wrong(self, wrong: float) -> float:
        """Return the share, 0 to 1, of the next step to take; wrong : m, the largest gap or penetration now. From the
        fifth call on, the share shrinks whenever ``wrong`` has hardly fallen since the call before, and else grows."""
        self._calls += 1
        if wrong > max(_PROGRESS * self._last, GAP_TOLERANCE) and self._calls > _FREE_ITERATIONS:
            self._trust = max(_SHRINK * self._trust, _LEAST_TRUST)
        else:
            self._trust = min(_GROW * self._trust, 1.0)
        self._last = wrong
        self._best.append(min([wrong, *self._best[-1:]]))
        return self._trust


class Frictionless:
    """Solver for the k nodes and c points over the core of one ``ComplianceBlock``.
    rest : (k, 3) m, the nodes at rest; core_gap : (c,) m, without forces; pose : of the indenter at shift 0
    probe : (k, 3) m, offset from a node in a crease to where its face's distance is measured, else 0
    faced : (k,) bool, nodes that need no search for a second face
    most_curved : most tangent directions in the Newton step; more of them cost more time than they save"""

    most_curved = 20

    def __init__(
        self, block: ComplianceBlock, rest: np.ndarray, core_gap: np.ndarray, indenter: Indenter, pose: Pose,
        probe: np.ndarray, faced: np.ndarray,
    ) -> None:  # fmt: skip
        self.block, self.rest, self.core_gap = block, rest, core_gap
        self.indenter, self.pose, self.probe, self.faced = indenter, pose, probe, faced
        self._probes = bool(probe.any())

    def distance(self, displacement: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray]:
        """Return gaps (k,) m and normals (k, 3) under a displacement (k, 3) m and a shift of the indenter, m, along its
        motion; a crease's second face is measured at the point moved by ``probe``."""
        points = self.rest + displacement
        there = self.pose.moved(shift) if shift else self.pose
        if not self._probes:
            return there.distance(self.indenter, points)
        gap, normal = there.distance(self.indenter, points + self.probe)
        return gap - np.einsum("ai,ai->a", self.probe, normal), normal

    def solve(self, begin: Try, axial_force: float | None) -> Try:
        """Solve from the first guess ``begin``: the contact at ``pose``, moved by the guess's shift, or, if
        ``axial_force`` is given, at that force, N along the motion.
        The result is not ``settled`` if iterations run out or faces flip. Raises UnsolvedError if a step fails."""
        state, place, pace, model, solved = begin, begin.displacement, Pace(), None, None
        gap, normal = self.distance(place, state.shift)
        flips = np.zeros(len(gap), int)
        for iteration in range(1, MAX_ITERATIONS + 1):
            model = self._model(normal, model)
            offset = self._offset(gap, normal, place, model, solved)
            solved = self._complement(model, offset, normal, state.active, axial_force)
            state = self._step(state, place, model.matrix, normal, solved, iteration)
            left = gap
            gap, turned = self.distance(state.displacement, state.shift)
            state.iterations = iteration
            state.settled = self._settled(state, gap, turned, solved.step, axial_force)
            if state.settled:
                return state
            flipped = solved.active[: len(gap)] & (np.einsum("ai,ai->a", turned, normal) < _CREASE_ANGLE)
            if iteration >= _CREASE_ITERATION:
                flips += flipped & ~self.faced
                if (flips >= 2).any():
                    nodes = np.flatnonzero(flips >= 2)
                    points = (self.rest + place)[nodes] - left[nodes, None] * normal[nodes]
                    state.creases = nodes, points, normal[nodes]
                    return state
            trust = pace.after(gap, solved.active[: len(gap)])
            place = place + trust * (state.displacement - place)
            gap, normal = (gap, turned) if trust == 1 else self.distance(place, state.shift)
        return state

    def _model(self, normal: np.ndarray, older: _Model | None) -> _Model:
        """Return the model at unit vectors ``normal`` (k, 3): the older one, updated where these have turned far."""
        if older is None:
            return _Model(normal, self.block.normal(normal), {})
        stale = np.flatnonzero(np.abs(normal - older.normal).max(axis=1) > _STALE)
        if not len(stale):
            return older
        if len(stale) > _FEW * len(normal):
            return _Model(normal, self.block.normal(normal), {})
        mixed = older.normal.copy()
        mixed[stale] = normal[stale]
        return _Model(mixed, self.block.turned(older.matrix, mixed, stale), {})

    def _offset(self, gap, normal, place, model, solved) -> np.ndarray:  # noqa: ANN001
        """Return gaps (k + c,) m at zero force; with a model of older normals they are exact only at present forces.
        gap, normal : (k,) m, (k, 3), at the displacement ``place`` (k, 3) m; solved : the last forces, or None"""
        if solved is None or model.normal is normal:
            return np.concatenate([gap - np.einsum("ai,ai->a", normal, place), self.core_gap])
        k = self.block.k
        moved, core = self.block.respond(solved.pressing[:k, None] * normal, solved.pressing[k:])
        now = np.concatenate([gap + np.einsum("ai,ai->a", normal, moved - place), self.core_gap + core])
        return now - model.matrix @ solved.pressing

    def _complement(self, model, offset, normal, active, axial_force) -> Pressing:  # noqa: ANN001
        """Solve the linearised problem; for a given axial_force, N, go deeper by ``_LARGEST_STEP`` at most."""
        matrix = model.matrix
        if axial_force is None:
            return complement(matrix, offset, active, factors=model.factors)
        along = np.concatenate([normal @ self.pose.direction, np.zeros(self.block.c)])
        solved = complement(matrix, offset, active, along, axial_force, factors=model.factors)
        if abs(solved.step) <= _LARGEST_STEP:
            return solved
        step = float(np.clip(solved.step, -_LARGEST_STEP, _LARGEST_STEP))
        found = complement(matrix, offset - step * along, solved.active, factors=model.factors)
        return dataclasses.replace(found, step=step)

    def _step(self, state: Try, place, matrix, normal, solved: Pressing, iteration: int) -> Try:  # noqa: ANN001
        k = self.block.k
        force, core_force = solved.pressing[:k, None] * normal, solved.pressing[k:]
        displacement, _ = self.block.respond(force, core_force)
        if iteration > 1:
            threshold = _FEELS_AT_ONCE if iteration < _LATER else _FEELS_CURVATURE
            travel = displacement - place - solved.step * self.pose.direction
            more = self._turn(matrix, normal, solved, travel, self.rest + place + self.probe, state.shift, threshold)
            if more is not None:
                force, core_force = force + more[0], core_force + more[1]
                displacement, _ = self.block.respond(force, core_force)
        return Try(displacement, force, core_force, state.shift + solved.step, solved.active)

    def _turn(self, matrix, normal, solved: Pressing, travel, place, shift, threshold):  # noqa: ANN001, ANN202
        """Return the part of Newton's step that comes from normals turning as nodes move along the indenter: changes of
        force (k, 3) N at nodes and (c,) N at the core; None if no normal turns enough to matter.
        A node under force p with normal n gets the force p n + t y. Here t is a principal direction of the indenter's
        surface there, scaled by sqrt(p x curvature); y solves (1 - S) y = t . travel; S is the compliance between all
        these t while the gaps stay closed.
        """
        from scipy.linalg import lapack

        active = np.flatnonzero(solved.active)
        touching = active[active < self.block.k]
        bend = self.pose.moved(shift).curvature(self.indenter, place[touching])
        feels = solved.pressing[touching] * matrix.diagonal()[touching]
        most = feels * lengths(bend.reshape(-1, 9))
        if most.max(initial=0.0) < threshold:
            return None
        felt = np.sort(np.argsort(-most, kind="stable")[: self.most_curved])
        curvature, axes = np.linalg.eigh(bend[felt])
        weight = (np.maximum(curvature, 0) * solved.pressing[touching[felt], None]).ravel()
        share = (np.maximum(curvature, 0) * feels[felt, None]).ravel()
        chosen = np.argsort(-share, kind="stable")[: self.most_curved]
        chosen = chosen[share[chosen] > _FEELS_CURVATURE]
        if not len(chosen):
            return None
        nodes, root = touching[felt[chosen // 3]], np.sqrt(weight[chosen])
        tangent = axes[chosen // 3, :, chosen % 3] * root[:, None]
        core = active[len(touching) :] - self.block.k
        among, onto_gaps = _tangent_response(self.block.matrix, self.block.k, nodes, tangent, normal, touching, core)
        relief, _ = lapack.dpotrs(solved.factor, onto_gaps.T, lower=1)
        among = among - onto_gaps @ relief
        mode, shape = np.linalg.eigh((among + among.T) / 2)
        driven = shape.T @ np.einsum("qi,qi->q", tangent, travel[nodes])
        amount = shape @ (driven / _stiffness(mode))
        turn = np.abs(amount / root * curvature.ravel()[chosen]).max()
        amount *= min(1.0, _LARGEST_TURN / max(turn, 1e-30))
        change = np.zeros(len(solved.pressing))
        change[active] = -(relief @ amount)
        force = change[: self.block.k, None] * normal
        np.add.at(force, nodes, amount[:, None] * tangent)
        return force, change[self.block.k :]

    def _settled(self, state: Try, gap, normal, step, axial_force) -> bool:  # noqa: ANN001
        """Return true if gaps are closed, forces press along the normals as they are now, and the force is reached."""
        active = state.active[: len(gap)]
        if not active.any():
            return bool((gap > -GAP_TOLERANCE).all()) and axial_force is None
        if gap.min() < -GAP_TOLERANCE or np.abs(gap[active]).max() > GAP_TOLERANCE:
            return False
        pressing = np.einsum("ai,ai->a", state.force, normal)
        whole = np.linalg.norm(state.force.sum(0))
        if np.linalg.norm(state.force - pressing[:, None] * normal) > SIDEWAYS_TOLERANCE * whole:
            return False
        if pressing.min() < 0 or state.core_force.min(initial=0.0) < 0:
            return False
        axial = float(state.force.sum(0) @ self.pose.direction)
        return axial_force is None or abs(axial - axial_force) <= AXIAL_TOLERANCE * abs(axial_force)


def _stiffness(mode: np.ndarray) -> np.ndarray:
    """Return Newton's divisor 1 - mode, limited; a mode above 1 is unstable, and the step goes the way it leaves."""
    away = np.minimum(mode - 1, _SLOPE_STIFFNESS)
    return np.maximum(np.where(mode < 1, 1 - mode, away), _LEAST_STIFFNESS)


@Loop
def _tangent_response(matrix, k, nodes, tangent, normal, touching, core):  # noqa: ANN001, ANN202
    """Return the motion (q, q) along weighted tangents, ``tangent`` (q, 3), at ``nodes`` (q,) under unit forces along
    them; and the change (q, t + d) of the gaps of the touching nodes (t,), along ``normal`` (k, 3), and of the block's
    inner points ``core`` (d,) that press on the core. matrix, k : the ``ComplianceBlock``'s"""
    q, t, d = len(nodes), len(touching), len(core)
    among, onto_gaps = np.empty((q, q)), np.empty((q, t + d))
    for each in range(q):
        x, y, z = tangent[each, 0], tangent[each, 1], tangent[each, 2]
        first, second, third = matrix[3 * nodes[each]], matrix[3 * nodes[each] + 1], matrix[3 * nodes[each] + 2]
        for b in range(t):
            total = 0.0
            for i in range(3):
                j = 3 * touching[b] + i
                total += (x * first[j] + y * second[j] + z * third[j]) * normal[touching[b], i]
            onto_gaps[each, b] = total
        for b in range(d):
            j = 3 * k + core[b]
            onto_gaps[each, t + b] = x * first[j] + y * second[j] + z * third[j]
        for other in range(q):
            total = 0.0
            for i in range(3):
                j = 3 * nodes[other] + i
                total += (x * first[j] + y * second[j] + z * third[j]) * tangent[other, i]
            among[each, other] = total
    return among, onto_gaps
