"""Small-strain, nearly incompressible elasticity: Q2 displacement with a discontinuous linear pressure per cell.

The pressure is eliminated cell by cell, so the global matrix is symmetric positive definite in the displacement.
Q2/P1 is inf-sup stable and does not lock: Boffi, Brezzi, Fortin, Mixed Finite Element Methods, 2013, section 8.6.
"""

from __future__ import annotations

import numpy as np

from ...sensors import Material

_POINTS, _POINT_WEIGHTS = np.polynomial.legendre.leggauss(3)


def quadratic(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the values (n, 3) and slopes (n, 3) at t (n,) of the quadratic Lagrange polynomials on nodes -1, 0, 1."""
    value = np.stack([t * (t - 1) / 2, 1 - t**2, t * (t + 1) / 2], -1)
    slope = np.stack([t - 0.5, -2 * t, t + 0.5], -1)
    return value, slope


def reference_gradients() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the Gauss points (27, 3), weights (27,) and shape gradients (27, 27, 3), by node and axis, in a cube."""
    points = np.stack(np.meshgrid(_POINTS, _POINTS, _POINTS, indexing="ij"), -1).reshape(-1, 3)
    weights = np.einsum("a,b,c->abc", *[_POINT_WEIGHTS] * 3).ravel()
    (fx, dx), (fy, dy), (fz, dz) = (quadratic(points[:, k]) for k in range(3))

    def product(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return np.einsum("qa,qb,qc->qcba", x, y, z).reshape(len(points), 27)

    return points, weights, np.stack([product(dx, fy, fz), product(fx, dy, fz), product(fx, fy, dz)], -1)


def cell_stiffness(corners: np.ndarray, material: Material) -> np.ndarray:
    """Return the stiffness (n_cells, 81, 81), N/m, of cells with nodes at ``corners`` (n_cells, 27, 3) m.

    It is 2 mu dev(strain) : dev(strain) plus kappa times the volume change projected on linear functions of the cell.
    Raises ValueError for a cell that is turned inside out at a Gauss point."""
    shear = material.youngs / (2 * (1 + material.poisson))
    bulk = material.youngs / (3 * (1 - 2 * material.poisson))
    points, weights, reference = reference_gradients()
    linear = np.column_stack([np.ones(len(points)), points])
    n = len(corners)
    stiffness = np.zeros((n, 27, 3, 27, 3))
    divergence, mass = np.zeros((n, 4, 81)), np.zeros((n, 4, 4))
    for q in range(len(points)):
        jacobian = np.einsum("ak,ead->ekd", reference[q], corners)  # d x_d / d xi_k
        volume = np.linalg.det(jacobian)
        if not (volume > 0).all():
            raise ValueError(f"{int((volume <= 0).sum())} cells are turned inside out")
        gradient = np.einsum("ak,edk->ead", reference[q], np.linalg.inv(jacobian))
        weight = weights[q] * volume
        outer = np.einsum("e,eai,ebj->eaibj", shear * weight, gradient, gradient, optimize=True)
        stiffness += outer.swapaxes(2, 4) - (2 / 3) * outer
        trace = np.einsum("eaiib->eab", outer.transpose(0, 1, 2, 4, 3))
        for i in range(3):
            stiffness[:, :, i, :, i] += trace
        divergence += np.einsum("e,p,eai->epai", weight, linear[q], gradient).reshape(n, 4, 81)
        mass += np.einsum("e,p,r->epr", weight, linear[q], linear[q])
    swelling = np.einsum("epi,epj->eij", divergence, np.linalg.solve(mass, divergence), optimize=True)
    return stiffness.reshape(n, 81, 81) + bulk * swelling
