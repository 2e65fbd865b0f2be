"""The volume of the BioTac's fluid, which is incompressible and has one pressure, in finite strain."""

from __future__ import annotations

import functools

import numpy as np

from .elasticity import _POINT_WEIGHTS, _POINTS, quadratic


class FluidCavity:
    """Volume inside a skin of quadratic faces, with its exact first and second derivatives.

    V = 1/3 of the integral of x . (dx/dxi x dx/deta) over the faces, trilinear in the nodes: a sum over nodes a, b, c
    of antisymmetric coefficients times x_a . (x_b x x_c).
    """

    def __init__(self, faces: np.ndarray, n_nodes: int) -> None:
        """Take faces (n, 9), mesh nodes: node 3 a + b at (xi, eta) = (a, b) - 1, with xi, eta and outward right-handed.
        n_nodes : number of all the mesh's nodes"""
        self.faces, self.n_nodes = faces, n_nodes

    def volume(self, nodes: np.ndarray) -> float:
        """Return the volume, m3, for positions ``nodes`` (n_nodes, 3) m."""
        return float((nodes.ravel() @ self.gradient(nodes)) / 3)

    def gradient(self, nodes: np.ndarray) -> np.ndarray:
        """Return the gradient dV / d(node) (3 n_nodes,), m2, at positions ``nodes`` (n_nodes, 3) m."""
        corners = nodes[self.faces]
        parts = 3 * np.cross(corners[:, None], self._arms(corners)).sum(axis=2)
        gradient = np.zeros((self.n_nodes, 3))
        np.add.at(gradient, self.faces.ravel(), parts.reshape(-1, 3))
        return gradient.ravel()

    def hessian(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return d2V / d(node)2, at nodes (n_nodes, 3) m: pairs (k,), (k,), blocks (k, 3, 3) m, to be summed by
        pair."""
        arms = self._arms(nodes[self.faces])
        rows, columns = np.repeat(self.faces, 9, axis=1).ravel(), np.tile(self.faces, (1, 9)).ravel()
        return rows, columns, -6 * _cross_matrix(arms.reshape(-1, 3))

    def _arms(self, corners: np.ndarray) -> np.ndarray:
        return np.einsum("abc,fci->fabi", _coefficients(), corners, optimize=True)


@functools.cache
def _coefficients() -> np.ndarray:
    """Return (9, 9, 9), antisymmetric: 1/3 of the integral of N_a dN_b/dxi dN_c/deta, exact by three Gauss points."""
    value, slope = quadratic(_POINTS)
    weights = np.einsum("p,q->pq", _POINT_WEIGHTS, _POINT_WEIGHTS)
    shape, along, across = (
        np.einsum("pa,qb->pqab", first, second).reshape(3, 3, 9)
        for first, second in ((value, value), (slope, value), (value, slope))
    )
    product = np.einsum("pq,pqa,pqb,pqc->abc", weights, shape, along, across) / 3
    even = sum(product.transpose(order) for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)))
    odd = sum(product.transpose(order) for order in ((1, 0, 2), (0, 2, 1), (2, 1, 0)))
    return (even - odd) / 6


def _cross_matrix(v: np.ndarray) -> np.ndarray:
    """Return the matrices M (n, 3, 3) with M w = v x w for any vector w. v : (n, 3)"""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(-1, 3, 3)
