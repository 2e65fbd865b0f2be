"""Make a block of brick cells for small checks, and find its equilibrium under a given boundary."""

from __future__ import annotations

import numpy as np

from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid, State
from tactile_core.mechanics.solids.hex_mesh import HexMesh, hex_cells
from tactile_core.mechanics.solids.sparse_cholesky import factor

_MAX_ITERATIONS = 30
_SETTLED = 1e-15  # of the block's size: rounding


def block(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> HexMesh:
    """Make a block with nodes on planes x, y, z, m, odd numbers; y falls from the clamped back to the surface."""
    grid = np.stack(np.meshgrid(x, z, y, indexing="ij"), -1)[..., [0, 2, 1]]
    ids = np.arange(grid[..., 0].size).reshape(grid.shape[:-1])
    clamped = np.zeros(ids.size, bool)
    clamped[ids[..., 0]] = True
    return HexMesh(grid.reshape(-1, 3), hex_cells(ids), clamped, ids[..., -1].ravel(), np.empty(0, int))


def inside(mesh: HexMesh) -> np.ndarray:
    """Return a mask (n,) bool of a block's nodes that do not lie on its sides."""
    low, high = mesh.nodes.min(0), mesh.nodes.max(0)
    margin = 1e-6 * (high - low)
    return ((mesh.nodes > low + margin) & (mesh.nodes < high - margin)).all(1)


def equilibrium(solid: FiniteStrainSolid, start: State, free: np.ndarray, load: np.ndarray | None = None) -> State:
    """Return the equilibrium under outer forces ``load`` (3 n,) N, None for none. Nodes move if ``free`` (n,) bool is
    true for them, others stay as in ``start``. Raises ArithmeticError if no equilibrium is found."""
    state, loose = start.copy(), np.repeat(free, 3)
    size = np.ptp(solid.mesh.nodes, axis=0).max()
    for _ in range(_MAX_ITERATIONS):
        lines = solid.linearise(state)
        force = lines.internal_force() - (0 if load is None else load)
        step = np.zeros(force.size)
        matrix = lines.matrix()[loose][:, loose].tocsc()
        step[loose] = factor(matrix)(-force[loose, None])[:, 0]
        state.displacement += step.reshape(-1, 3)
        state.pressure += lines.pressure_step(step.reshape(-1, 3))
        if np.abs(step).max() < _SETTLED * size:
            return state
    raise ArithmeticError(f"no equilibrium after {_MAX_ITERATIONS} iterations")
