"""The BioTac's fluid in finite strain: incompressible, one pressure in the whole cavity."""

from __future__ import annotations

import numpy as np


class Cavity:
    """Volume inside a closed skin of triangles, with its exact first and second derivatives.

    V = sum over triangles of a . (b x c) / 6 (divergence theorem), corners (a, b, c) of the moved nodes.
    """

    def __init__(self, faces: np.ndarray, n_nodes: int) -> None:
        """faces : (n, 3) mesh nodes, seen from outside the fluid counter-clockwise; n_nodes : of the mesh."""
        self.faces, self.n_nodes = faces, n_nodes

    def volume(self, nodes: np.ndarray) -> float:
        """m3, for node positions (n_nodes, 3) m."""
        a, b, c = np.moveaxis(nodes[self.faces], 1, 0)
        return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)

    def gradient(self, nodes: np.ndarray) -> np.ndarray:
        """dV / d(node) (3 n_nodes,), m2."""
        a, b, c = np.moveaxis(nodes[self.faces], 1, 0)
        parts = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], 1) / 6
        gradient = np.zeros((self.n_nodes, 3))
        np.add.at(gradient, self.faces.ravel(), parts.reshape(-1, 3))
        return gradient.ravel()

    def hessian(self, nodes: np.ndarray):  # noqa: ANN201 (scipy is imported only where it is needed)
        """d2V / d(node)2, scipy CSC (3 n_nodes, 3 n_nodes), m; symmetric."""
        import scipy.sparse

        corners = nodes[self.faces]
        rows, columns, values = [], [], []
        axes = np.arange(3)
        for i, j, k, sign in ((0, 1, 2, 1), (1, 2, 0, 1), (2, 0, 1, 1), (1, 0, 2, -1), (2, 1, 0, -1), (0, 2, 1, -1)):
            # d/db of (b x c) / 6 is -[c]x / 6, so the block (a, b) is the matrix of v -> v x c
            blocks = -sign * _cross_matrix(corners[:, k]) / 6
            rows.append(np.broadcast_to(3 * self.faces[:, i, None, None] + axes[:, None], blocks.shape).ravel())
            columns.append(np.broadcast_to(3 * self.faces[:, j, None, None] + axes, blocks.shape).ravel())
            values.append(blocks.ravel())
        places = np.concatenate(rows), np.concatenate(columns)
        size = 3 * self.n_nodes
        return scipy.sparse.coo_matrix((np.concatenate(values), places), shape=(size, size)).tocsc()


def _cross_matrix(v: np.ndarray) -> np.ndarray:
    """Matrices (n, 3, 3) with M w = v x w."""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(-1, 3, 3)
