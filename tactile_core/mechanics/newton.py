"""Frictionless contact of a rigid indenter with a finite-strain solid: Newton's method with an exact active set.

A touching node may slide on the indenter but not leave along its normal: its degrees of freedom are turned into the
indenter's frame and the normal one is prescribed, so the matrix stays symmetric positive definite. The BioTac's fluid
adds one unknown, its pressure, by a bordered solve.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..errors import TactileError
from ..indenters import Indenter, Pose
from .cavity import Cavity
from .factor import NotPositiveDefiniteError, factor
from .finite_strain import FiniteStrainSolid, State

GAP_TOLERANCE = 1e-9  # m
BALANCE_TOLERANCE = 1e-8  # of the largest nodal force, and of the fluid's volume
MAX_ITERATIONS = 25
SMALLEST_STEP = 1 / 64  # of a load step; halved below that, the path has ended
_CURVATURE_STEP = 1e-7  # m, central differences of the exact normals


@dataclasses.dataclass
class Touch:
    """A solved contact. depth : m; state : of the solid; pressing : (k,) N, normal force of the touching ``nodes``.

    nodes : (k,) mesh nodes; normals : (k, 3) of the indenter there
    fluid : Pa, rise of the fluid's pressure; iterations : Newton iterations of the last load step
    steps : load steps, halved ones counted
    """

    depth: float
    state: State
    nodes: np.ndarray
    pressing: np.ndarray
    normals: np.ndarray
    fluid: float = 0.0
    iterations: int = 0
    steps: int = 0

    @property
    def force(self) -> np.ndarray:
        """Total force (3,) N of the indenter on the sensor."""
        return self.pressing @ self.normals


class _NotConvergedError(Exception):
    """A load step is too large."""


class FiniteStrainContact:
    """An indenter at a pose in front of a solid; follows a path of growing depth.

    touchable : (m,) mesh nodes that the indenter may touch
    fixed : (3 n,) bool, degrees of freedom that do not move; None: those of the clamped nodes
    cavity : incompressible fluid in the solid; ``pre_inflation`` m3 is added to its volume at rest
    """

    def __init__(
        self,
        solid: FiniteStrainSolid,
        touchable: np.ndarray,
        indenter: Indenter,
        pose: Pose,
        cavity: Cavity | None = None,
        pre_inflation: float = 0.0,
        fixed: np.ndarray | None = None,
    ) -> None:
        self.solid, self.touchable, self.indenter, self.pose, self.cavity = solid, touchable, indenter, pose, cavity
        self.fixed = (np.repeat(solid.mesh.clamped, 3) if fixed is None else fixed).reshape(-1, 3)
        self.volume = pre_inflation + (cavity.volume(solid.mesh.nodes) if cavity else 0.0)

    def start(self) -> Touch:
        """Nothing is deformed; a pre-inflated skin finds its shape in the first step."""
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
                    found = f"no equilibrium beyond {touch.depth * 1e3:.3f} mm"
                    raise TactileError("reference solver", found, "a smaller depth") from None
            steps += 1
        return dataclasses.replace(touch, steps=steps)

    def _solve(self, depth: float, start: Touch) -> Touch:
        """One load step, from a solved contact."""
        pose, state, fluid = self.pose.moved(depth), start.state.copy(), start.fluid
        pressing = np.zeros(len(self.solid.mesh.nodes))
        pressing[start.nodes] = start.pressing
        active = np.isin(self.touchable, start.nodes) | (self._gaps(pose, state)[0] < 0)
        for iteration in range(1, MAX_ITERATIONS + 1):
            step, normal_force, fluid, imbalance = self._newton(pose, state, active, pressing, fluid)
            state.displacement += step
            distance, normal = self._gaps(pose, state)
            pressing = np.zeros_like(pressing)
            pressing[self.touchable[active]] = normal_force
            release = active.copy()
            release[active] = normal_force < 0
            enter = ~active & (distance < -GAP_TOLERANCE)
            settled = not release.any() and not enter.any() and np.abs(distance[active]).max(initial=0) < GAP_TOLERANCE
            if settled and imbalance < BALANCE_TOLERANCE:
                nodes = self.touchable[active]
                return Touch(depth, state, nodes, pressing[nodes], normal[active], fluid, iteration)
            active = (active & ~release) | enter
        raise _NotConvergedError

    def _gaps(self, pose: Pose, state: State) -> tuple[np.ndarray, np.ndarray]:
        nodes = self.solid.mesh.nodes[self.touchable] + state.displacement[self.touchable]
        return pose.distance(self.indenter, nodes)

    def _newton(self, pose, state, active, pressing, fluid):  # noqa: ANN001, ANN202
        """Displacement step (n, 3), normal forces (k,) and fluid pressure after it, relative imbalance before it."""
        lines = self.solid.linearise(state)
        largest = np.abs(lines.internal_force(condensed=False)).max()
        distance, normal = self._gaps(pose, state)
        nodes = self.touchable[active]
        turn, free, prescribed = self._turn(nodes, normal[active])
        matrix, residual = lines.matrix() - self._curvature(pose, state, active, pressing), lines.internal_force()
        swell, excess = np.zeros(len(residual)), 0.0
        if self.cavity:
            moved = self.solid.mesh.nodes + state.displacement
            swell, excess = self.cavity.gradient(moved), self.cavity.volume(moved) - self.volume
            residual = residual - fluid * swell
            matrix = matrix - fluid * self.cavity.hessian(moved)
        matrix = (turn.T @ matrix @ turn).tocsc()
        residual, swell = turn.T @ residual, turn.T @ swell
        step = np.zeros(len(residual))
        step[prescribed] = -distance[active]
        solved = np.setdiff1d(free, prescribed)
        load = -residual[solved] - (matrix @ step)[solved]
        answer = factor(matrix[solved][:, solved].tocsc())(np.column_stack([load, swell[solved]]))
        rise = 0.0
        if self.cavity:
            known = excess + swell[prescribed] @ step[prescribed] + swell[solved] @ answer[:, 0]
            rise = -known / float(swell[solved] @ answer[:, 1])
        step[solved] = answer[:, 0] + rise * answer[:, 1]
        reaction = residual[prescribed] + (matrix @ step)[prescribed] - rise * swell[prescribed]
        step = (turn @ step).reshape(-1, 3)
        state.pressure += lines.pressure_step(step)
        imbalance = np.abs(residual[solved]).max() / max(largest, 1e-12), abs(excess) / max(self.volume, 1e-12)
        return step, reaction, fluid + rise, float(max(imbalance))

    def _turn(self, nodes: np.ndarray, normals: np.ndarray):  # noqa: ANN202 (scipy sparse)
        """Orthogonal matrix that turns touching nodes into (normal, tangents), free and normal degrees of freedom.

        One tangent lies across the axis that the normal has least of: on a plane of symmetry that is its own.
        """
        helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
        first = np.cross(normals, helper)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        frames = np.stack([normals, first, np.cross(normals, first)], -1)
        size = len(self.solid.mesh.nodes)
        still = np.setdiff1d(np.arange(size), nodes)
        same = np.broadcast_to(np.eye(3), (len(still), 3, 3))
        fixed = self.fixed.copy()
        fixed[nodes] = np.einsum("nij,ni->nj", frames**2, self.fixed[nodes]) > 0.5
        turn = _blocks(np.r_[nodes, still], np.concatenate([frames, same]), size)
        return turn, np.flatnonzero(~fixed.ravel()), 3 * nodes

    def _curvature(self, pose, state, active, pressing):  # noqa: ANN001, ANN202 (scipy sparse)
        """Change of the contact forces with the normal's turn: pressing times the Hessian of the distance."""
        nodes = self.touchable[active]
        at = self.solid.mesh.nodes[nodes] + state.displacement[nodes]
        blocks = np.empty((len(at), 3, 3))
        for k, axis in enumerate(np.eye(3) * _CURVATURE_STEP):
            ahead, behind = (pose.distance(self.indenter, at + s * axis)[1] for s in (1, -1))
            blocks[:, :, k] = (ahead - behind) / (2 * _CURVATURE_STEP)
        blocks = (blocks + blocks.swapaxes(1, 2)) / 2 * pressing[nodes][:, None, None]
        return _blocks(nodes, blocks, len(self.solid.mesh.nodes))


def _blocks(nodes: np.ndarray, blocks: np.ndarray, size: int):  # noqa: ANN202 (scipy sparse)
    """Sparse (3 size, 3 size) with a 3 x 3 block on the diagonal at each of ``nodes``."""
    import scipy.sparse

    shape = blocks.shape
    rows = np.broadcast_to(3 * nodes[:, None, None] + np.arange(3)[:, None], shape).ravel()
    columns = np.broadcast_to(3 * nodes[:, None, None] + np.arange(3), shape).ravel()
    return scipy.sparse.coo_matrix((blocks.ravel(), (rows, columns)), shape=(3 * size, 3 * size)).tocsc()
