"""The compliance among the nodes that enter a contact's solve."""

from __future__ import annotations

import numpy as np

from ...files.compiled import available
from .compliance import Compliance
from .compliance_rows import ComplianceRows
from .frictionless_loops import normal_compliance
from .interpolated_points import SpringRows
from .mirror_symmetry import axes_of

# Relative stiffness added to each node: 1e-6 moves a gap by nanometres and keeps single precision definite, also where
# one node presses two faces of a concave corner.
_RIDGE = 1e-6
_INNER = 2**40  # more than a surface has degrees of freedom


class ComplianceBlock:
    """Compliance of k surface nodes (three axes) and c points of the inner skin that may press on the core.

    nodes : (k,) sorted touchable indices (with ``SpringRows`` its numbers), twice where one touches two faces
    inner : (c,) sorted sensing points
    rows : the entries of nodes near them, where they are already at hand
    matrix : (3 k + c, 3 k + c) float32, m/N: surface axes first
    """

    def __init__(
        self,
        compliance: Compliance,
        nodes: np.ndarray,
        inner: np.ndarray,
        rows: ComplianceRows | SpringRows | None = None,
    ) -> None:
        self.nodes, self.inner = nodes, inner
        self.k, self.c = len(nodes), len(inner)
        self.keys = np.concatenate([axes_of(nodes), _INNER + inner])  # (3 k + c,), sorted: the same in every block
        size = 3 * self.k
        rows = rows or ComplianceRows(compliance, np.unique(nodes))
        surface = rows.block(nodes)
        self.matrix = surface if not self.c else np.empty((size + self.c, size + self.c), np.float32)
        if self.c:
            self.matrix[:size, :size] = surface
            self.matrix[:size, size:] = rows.sensing_motion(nodes, inner)
            self.matrix[size:, :size] = self.matrix[:size, size:].T
            self.matrix[size:, size:] = compliance.inner_watch[np.ix_(inner, inner)]

    def respond(self, force: np.ndarray, pressing_core: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return displacement (k, 3) m and motion (c,) m of inner points off the core, by forces (k, 3), (c,) N."""
        answer = np.concatenate([force.ravel(), pressing_core]).astype(np.float32) @ self.matrix
        return answer[: 3 * self.k].reshape(self.k, 3).astype(float), answer[3 * self.k :].astype(float)

    def along(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Return the compliance (k, k) m/N from forces along ``right`` (k, 3) to displacement along ``left``."""
        size = 3 * self.k
        return _contract(self.matrix[:size, :size], left.astype(np.float32), right.astype(np.float32)).astype(float)

    def normal(self, normals: np.ndarray) -> np.ndarray:
        """Return the compliance (k + c, k + c) m/N of the gaps: along ``normals`` (k, 3), and of the core's gaps."""
        k, size = self.k, 3 * self.k
        if available():
            return normal_compliance(self.matrix, np.ascontiguousarray(normals), self.c, _RIDGE)
        matrix = np.empty((k + self.c, k + self.c))
        matrix[:k, :k] = self.along(normals, normals)
        if self.c:
            side = np.einsum("aic,ai->ac", self.matrix[:size, size:].reshape(k, 3, self.c), normals)
            matrix[:k, k:], matrix[k:, :k] = side, side.T
            matrix[k:, k:] = self.matrix[size:, size:]
        matrix.flat[:: k + self.c + 1] *= 1 + _RIDGE
        return matrix

    def turned(self, matrix: np.ndarray, normals: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Update ``normal`` to ``normals`` (k, 3), where those of the nodes ``at`` (j,) have turned."""
        k, size = self.k, 3 * self.k
        rows = self.matrix.take(axes_of(at), axis=0)
        strips = _contract(rows[:, :size], normals[at].astype(np.float32), normals.astype(np.float32)).astype(float)
        strips[np.arange(len(at)), at] *= 1 + _RIDGE
        matrix = matrix.copy()
        matrix[at, :k], matrix[:k, at] = strips, strips.T
        if self.c:
            side = np.einsum("aic,ai->ac", rows[:, size:].reshape(len(at), 3, self.c), normals[at])
            matrix[at, k:], matrix[k:, at] = side, side.T
        return matrix


def _contract(block: np.ndarray, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Contract sum over i, j of source[a, i] block[a i, b j] target[b, j]; by strides, faster than einsum here."""
    half = block[:, 0::3] * target[:, 0]
    half += block[:, 1::3] * target[:, 1]
    half += block[:, 2::3] * target[:, 2]
    half = half.reshape(len(source), 3, len(target))
    return half[:, 0] * source[:, :1] + half[:, 1] * source[:, 1:2] + half[:, 2] * source[:, 2:]
