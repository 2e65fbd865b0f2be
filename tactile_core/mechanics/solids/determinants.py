"""Cofactors and determinants of many 3 x 3 matrices, written out: several times faster than LAPACK one by one."""

from __future__ import annotations

import numpy as np


def cofactors(f: np.ndarray) -> np.ndarray:
    """Return the cofactors (..., 3, 3) of matrices (..., 3, 3): det(f) times the transposed inverse."""
    a, b, c = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    answer = np.empty_like(f)
    for row, first, second in ((0, b, c), (1, c, a), (2, a, b)):
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            answer[..., row, k] = first[..., i] * second[..., j] - first[..., j] * second[..., i]
    return answer


def determinants(f: np.ndarray) -> np.ndarray:
    """Return the determinants (...,) of matrices (..., 3, 3)."""
    a, b, c = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    minors = (b[..., (k + 1) % 3] * c[..., (k + 2) % 3] - b[..., (k + 2) % 3] * c[..., (k + 1) % 3] for k in range(3))
    return sum(a[..., k] * minor for k, minor in enumerate(minors))
