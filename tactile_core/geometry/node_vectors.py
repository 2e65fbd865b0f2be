"""Products of a few nodes' vectors, several times quicker than numpy's general functions on so few."""

from __future__ import annotations

import numpy as np

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def dot(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Compute the dot products (n,) of vectors (n, 3)."""
    return np.einsum("ai,ai->a", left, right)


def cross(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Cross products (n, 3)."""
    turned = left.take(_NEXT, axis=1) * right.take(_LAST, axis=1)
    turned -= left.take(_LAST, axis=1) * right.take(_NEXT, axis=1)
    return turned


def weighted(parts: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the sum of three ``parts`` (3, ...) by ``weights`` (3, ...) in single precision."""
    weights = weights.astype(np.float32)
    total = parts[0] * weights[0]
    total += parts[1] * weights[1]
    total += parts[2] * weights[2]
    return total
