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

    def hessian(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """d2V / d(node)2: node pairs (k,), (k,) and the sum's 3 x 3 blocks (k, 3, 3), m, of each; pairs come again."""
        corners = nodes[self.faces]
        rows, columns, values = [], [], []
        for i, j, k, sign in ((0, 1, 2, 1), (1, 2, 0, 1), (2, 0, 1, 1), (1, 0, 2, -1), (2, 1, 0, -1), (0, 2, 1, -1)):
            # d/db of (b x c) / 6 is -[c]x / 6, so the block (a, b) is the matrix of v -> v x c
            rows.append(self.faces[:, i])
            columns.append(self.faces[:, j])
            values.append(-sign * _cross_matrix(corners[:, k]) / 6)
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)


def _cross_matrix(v: np.ndarray) -> np.ndarray:
    """Matrices (n, 3, 3) with M w = v x w."""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(-1, 3, 3)
