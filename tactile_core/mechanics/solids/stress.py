"""Stress in a deformed solid of 27-node cells: Cauchy and von Mises, at Gauss points and at nodes."""

from __future__ import annotations

import numpy as np

from .elasticity import reference_gradients
from .finite_strain import FiniteStrainSolid, State

_BATCH = 256  # cells at once: the law makes its tangent, too, 0.7 kB per point


def cauchy(solid: FiniteStrainSolid, state: State) -> np.ndarray:
    """Return the Cauchy stress (n_cells, 27, 3, 3) Pa at the Gauss points, tension positive: P F^T / J.

    P is the law's first Piola-Kirchhoff stress with the cell's own pressure. Raises FloatingPointError if a cell is
    turned inside out.
    """
    f, j = solid.deformation(state.displacement)
    if not (j > 0).all():
        raise FloatingPointError("a cell is turned inside out")
    p = state.pressure @ solid.linear.T
    stress = np.empty_like(f)
    for start in range(0, len(j), _BATCH):
        part = slice(start, start + _BATCH)
        piola, _ = solid.law.stress_tangent(f[part], j[part], p[part])
        stress[part] = np.einsum("eqiJ,eqkJ,eq->eqik", piola, f[part], 1 / j[part])
    return stress


def nodal_force(solid: FiniteStrainSolid, state: State) -> np.ndarray:
    """Return the external force (n, 3) N on each node: contact, fluid and reactions; zero at free nodes.

    Raises what ``cauchy`` raises.
    """
    return solid.linearise(state).internal_force(condensed=False).reshape(-1, 3)


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Return the Von Mises stress sqrt(3/2 s : s) (...,) Pa of stresses (..., 3, 3), s their deviator."""
    mean = np.einsum("...ii->...", stress) / 3
    deviator = stress - mean[..., None, None] * np.eye(3)
    return np.sqrt(1.5 * np.einsum("...ij,...ij->...", deviator, deviator))


def at_nodes(solid: FiniteStrainSolid, values: np.ndarray) -> np.ndarray:
    """Return a field's values (n, ...) at the nodes, from its values (n_cells, 27, ...) at the Gauss points.

    In each cell a trilinear function is fitted (local L2 projection); a node has the mean over its cells, by volume. A
    field that is linear in a cell's own coordinates is reproduced. For a smooth von Mises stress, smooth the tensor
    first.
    """
    flat = values.reshape(*values.shape[:2], -1)
    points, _, _ = reference_gradients()
    basis, corner = _trilinear(points), _trilinear(_node_places())
    weighted = basis * solid.weight[..., None]  # (e, q, 8)
    fitted = np.linalg.solve(weighted.swapaxes(1, 2) @ basis, weighted.swapaxes(1, 2) @ flat)
    local = corner @ fitted  # (e, 27, k)
    volume = np.repeat(solid.weight.sum(1), 27)
    nodes, size = solid.mesh.cells.ravel(), len(solid.mesh.nodes)
    share = np.bincount(nodes, volume, minlength=size)
    summed = [np.bincount(nodes, volume * column, minlength=size) for column in local.reshape(-1, flat.shape[2]).T]
    return (np.stack(summed, -1) / share[:, None]).reshape(size, *values.shape[2:])


def _trilinear(points: np.ndarray) -> np.ndarray:
    """Return the functions 1, x, y, z, xy, xz, yz, xyz (n, 8) at points (n, 3)."""
    x, y, z = points.T
    return np.column_stack([np.ones(len(points)), x, y, z, x * y, x * z, y * z, x * y * z])


def _node_places() -> np.ndarray:
    """Return the coordinates (27, 3) of a cell's nodes in its own frame, in ``HexMesh``'s order."""
    c, b, a = np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij")
    return np.stack([a, b, c], -1).reshape(-1, 3)
