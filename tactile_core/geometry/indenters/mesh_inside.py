"""Find the nodes of a regular grid that lie inside a closed triangle mesh, by the crossings of the grid's columns."""

from __future__ import annotations

import numpy as np

# Columns stand this part of the spacing beside the nodes, so that none meets an edge or a vertex; tried in turn.
_BESIDE = ((1.234e-4, 0.876e-4), (-0.543e-4, 1.567e-4), (0.987e-4, -1.654e-4))


class OverlapError(Exception):
    """Error for a mesh that overlaps itself: a column enters it twice before it leaves."""


def inside(triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, ...]) -> np.ndarray:
    """Mark (shape) bool the nodes at ``origin`` + spacing * (i, j, k) inside the mesh of triangles (m, 3, 3), one unit.

    Along each column the crossings must alternate between entering and leaving. Raises OverlapError where they do not;
    where a column grazes an edge, others beside it are tried first.
    """
    for beside in _BESIDE:
        column, height, entering = _crossings(triangles, origin + spacing * np.array([*beside, 0]), spacing, shape)
        order = np.lexsort((height, column))
        column, height, step = column[order], height[order], np.where(entering[order], 1, -1)
        layers = np.cumsum(step)
        if np.isin(layers, (0, 1)).all() and (layers[np.flatnonzero(np.diff(column, append=-1))] == 0).all():
            first_node = np.clip(np.ceil((height - origin[2]) / spacing), 0, shape[2]).astype(int)
            change = np.zeros((shape[0] * shape[1], shape[2] + 1), np.int32)
            np.add.at(change, (column, first_node), step)
            return (np.cumsum(change, axis=1)[:, :-1] > 0).reshape(shape)
    raise OverlapError


def _crossings(
    triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of columns and triangles: column (k,) int, height (k,), true (k,) where going up enters the body."""
    flat = (triangles[:, :, :2] - origin[:2]) / spacing
    low = np.clip(np.ceil(flat.min(axis=1)), 0, None).astype(int)
    high = np.minimum(np.floor(flat.max(axis=1)).astype(int), np.array(shape[:2]) - 1)
    size = np.maximum(high - low + 1, 0)
    count = size[:, 0] * size[:, 1]
    triangle = np.repeat(np.arange(len(triangles)), count)
    k = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    place = low[triangle] + np.column_stack([k // size[triangle, 1], k % size[triangle, 1]])
    arm = flat[triangle] - place[:, None]
    weights = np.stack([_cross(arm[:, (i + 1) % 3], arm[:, (i + 2) % 3]) for i in range(3)], axis=1)
    met = (weights > 0).all(axis=1) | (weights < 0).all(axis=1)
    weights, triangle, place = weights[met], triangle[met], place[met]
    height = np.einsum("nk,nk->n", weights, triangles[triangle, :, 2]) / weights.sum(axis=1)
    return place[:, 0] * shape[1] + place[:, 1], height, weights.sum(axis=1) < 0


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
