"""A smooth surface through the nodes of a grid: cubic (Catmull-Rom) along rows and columns, once differentiable."""

from __future__ import annotations

import numpy as np

from .biotac_shape import catmull_rom

_STEPS = np.arange(-1, 3)[:, None]


def on_grid(grid: np.ndarray, places: np.ndarray, *, closed: bool) -> np.ndarray:
    """Points (n, 3) m of the surface through ``grid`` (rows, columns, 3) m at fractional (row, column) places (2, n).

    closed : whether the last column joins the first; places beyond other ends lie on them
    """
    rows, columns = grid.shape[:2]
    row, column = np.minimum(np.maximum(places[0], 0), rows - 1), places[1]
    if not closed:
        column = np.minimum(np.maximum(column, 0), columns - 1)
    i, j = np.minimum(row.astype(int), rows - 2), np.floor(column).astype(int)
    if not closed:
        j = np.minimum(j, columns - 2)
    weights = catmull_rom(row - i)[:, None] * catmull_rom(column - j)
    at_row = np.minimum(np.maximum(i + _STEPS, 0), rows - 1)
    at_column = (j + _STEPS) % columns if closed else np.minimum(np.maximum(j + _STEPS, 0), columns - 1)
    axes = np.ascontiguousarray(grid.reshape(-1, 3).T)  # axis by axis: sums over many places at a time are faster
    nodes = axes.take(at_row[:, None] * columns + at_column, axis=1)
    return (weights * nodes).reshape(3, 16, -1).sum(axis=1).T
