"""Frictionless contact of a rigid indenter with a finite-strain solid: Newton's method with an exact active set.

A touching node may slide on the indenter but not leave along its normal: its degrees of freedom are turned into the
indenter's frame and the normal one is prescribed, so the matrix stays symmetric positive definite.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..errors import TactileError
from ..indenters import Indenter, Pose
from .factor import NotPositiveDefiniteError, factor
from .finite_strain import FiniteStrainSolid, State

GAP_TOLERANCE = 1e-9  # m
FORCE_TOLERANCE = 1e-8  # of the largest nodal force
MAX_ITERATIONS = 25
SMALLEST_STEP = 1 / 64  # of a load step; halved below that, the path has ended
_CURVATURE_STEP = 1e-7  # m, central differences of the exact normals


@dataclasses.dataclass
class Touch:
    """A solved contact. depth : m; state : of the solid; pressing : (k,) N, normal force of the touching ``nodes``.

    nodes : (k,) mesh nodes; normals : (k, 3) of the indenter there; force : (3,) N on the sensor
    iterations : Newton iterations of the last load step; steps : load steps, halved ones counted
    """

    depth: float
    state: State
    nodes: np.ndarray
    pressing: np.ndarray
    normals: np.ndarray
    iterations: int = 0
    steps: int = 0

    @property
    def force(self) -> np.ndarray:
        """Total force (3,) N of the indenter on the sensor."""
        return self.pressing @ self.normals


class _NotConvergedError(Exception):
    """A load step is too large."""


class FiniteStrainContact:
    """An indenter at a pose in front of a solid; follows a path of growing depth."""

    def __init__(self, solid: FiniteStrainSolid, touchable: np.ndarray, indenter: Indenter, pose: Pose) -> None:
        """touchable : (m,) mesh nodes that the indenter may touch."""
        self.solid, self.touchable, self.indenter, self.pose = solid, touchable, indenter, pose
        self.free = np.flatnonzero(np.repeat(~solid.mesh.clamped, 3))

    def start(self) -> Touch:
        """First touch: nothing is deformed."""
        return Touch(0.0, self.solid.rest(), np.empty(0, int), np.empty(0), np.empty((0, 3)))

    def press(self, depth: float, start: Touch | None = None, step: float = 0.1e-3) -> Touch:
        """The contact at ``depth`` m, reached from ``start`` in load steps of at most ``step`` m.

        A step that fails is halved. Raises TactileError with the depth reached where even 1/64 of a step fails.
        """
        touch = start or self.start()
        size, steps = step, 0
        while touch.depth < depth - 1e-12:
            goal = min(touch.depth + size, depth)
            try:
                touch = self._solve(goal, touch)
                size = min(step, 2 * size)
            except (_NotConvergedError, FloatingPointError, NotPositiveDefiniteError):
                size /= 2
                if size < step * SMALLEST_STEP:
                    raise TactileError(
                        "reference solver", f"no equilibrium beyond {touch.depth * 1e3:.3f} mm", "a smaller depth"
                    ) from None
            steps += 1
        return dataclasses.replace(touch, steps=steps)

    def _solve(self, depth: float, start: Touch) -> Touch:
        """One load step, from a solved contact."""
        pose = self.pose.moved(depth)
        state = start.state.copy()
        pressing = np.zeros(len(self.solid.mesh.nodes))
        pressing[start.nodes] = start.pressing
        active = self._guess(pose, state, start)
        for iteration in range(1, MAX_ITERATIONS + 1):
            step, normal_force, imbalance = self._newton(pose, state, active, pressing)
            state.displacement += step
            distance, normal = self._gaps(pose, state)
            pressing = np.zeros_like(pressing)
            pressing[self.touchable[active]] = normal_force
            release = active.copy()
            release[active] = normal_force < 0
            enter = ~active & (distance < -GAP_TOLERANCE)
            settled = not release.any() and not enter.any() and np.abs(distance[active]).max(initial=0) < GAP_TOLERANCE
            if settled and imbalance < FORCE_TOLERANCE * max(np.abs(normal_force).max(initial=0), 1e-9):
                nodes = self.touchable[active]
                return Touch(depth, state, nodes, pressing[nodes], normal[active], iteration)
            active = (active & ~release) | enter
        raise _NotConvergedError

    def _guess(self, pose: Pose, state: State, start: Touch) -> np.ndarray:
        active = np.isin(self.touchable, start.nodes)
        return active | (self._gaps(pose, state)[0] < 0)

    def _gaps(self, pose: Pose, state: State) -> tuple[np.ndarray, np.ndarray]:
        nodes = self.solid.mesh.nodes[self.touchable] + state.displacement[self.touchable]
        return pose.distance(self.indenter, nodes)

    def _newton(self, pose, state, active, pressing) -> tuple[np.ndarray, np.ndarray, float]:  # noqa: ANN001
        """Displacement step (n, 3), normal forces (k,) after it, and the force imbalance before it, N."""
        lines = self.solid.linearise(state)
        distance, normal = self._gaps(pose, state)
        nodes = self.touchable[active]
        turn, prescribed = self._turn(nodes, normal[active])
        matrix = lines.matrix() - self._curvature(pose, state, nodes, pressing)
        matrix = (turn.T @ matrix @ turn).tocsc()
        residual = turn.T @ lines.internal_force()
        step = np.zeros(len(residual))
        step[prescribed] = -distance[active]
        solved = np.setdiff1d(self.free, prescribed)
        load = -residual[solved] - (matrix @ step)[solved]
        step[solved] = factor(matrix[solved][:, solved].tocsc())(load[:, None])[:, 0]
        reaction = residual[prescribed] + (matrix @ step)[prescribed]
        step = (turn @ step).reshape(-1, 3)
        state.pressure += lines.pressure_step(step)
        return step, reaction, float(np.abs(residual[solved]).max())

    def _turn(self, nodes: np.ndarray, normals: np.ndarray):  # noqa: ANN202 (scipy sparse)
        """Orthogonal matrix that turns touching nodes into (normal, tangents), and their normal degrees of freedom."""
        import scipy.sparse

        helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
        first = np.cross(normals, helper)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        frames = np.stack([normals, first, np.cross(normals, first)], -1)
        size = 3 * len(self.solid.mesh.nodes)
        turned = np.zeros(size // 3, bool)
        turned[nodes] = True
        rows = (3 * nodes[:, None, None] + np.arange(3)[:, None]) + np.zeros(3, int)
        columns = (3 * nodes[:, None, None] + np.arange(3)) + np.zeros((3, 1), int)
        same = np.flatnonzero(np.repeat(~turned, 3))
        entries = np.r_[frames.ravel(), np.ones(len(same))]
        places = np.r_[rows.ravel(), same], np.r_[columns.ravel(), same]
        return scipy.sparse.coo_matrix((entries, places), shape=(size, size)).tocsr(), 3 * nodes

    def _curvature(self, pose, state, nodes, pressing):  # noqa: ANN001, ANN202 (scipy sparse)
        """Change of the contact forces with the normal's turn: pressing times the Hessian of the distance."""
        import scipy.sparse

        at = self.solid.mesh.nodes[nodes] + state.displacement[nodes]
        blocks = np.empty((len(nodes), 3, 3))
        for k, axis in enumerate(np.eye(3) * _CURVATURE_STEP):
            ahead, behind = pose.distance(self.indenter, at + axis)[1], pose.distance(self.indenter, at - axis)[1]
            blocks[:, :, k] = (ahead - behind) / (2 * _CURVATURE_STEP)
        blocks = (blocks + blocks.swapaxes(1, 2)) / 2 * pressing[nodes][:, None, None]
        rows = (3 * nodes[:, None, None] + np.arange(3)[:, None]) + np.zeros(3, int)
        columns = (3 * nodes[:, None, None] + np.arange(3)) + np.zeros((3, 1), int)
        size = 3 * len(self.solid.mesh.nodes)
        return scipy.sparse.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsc()
