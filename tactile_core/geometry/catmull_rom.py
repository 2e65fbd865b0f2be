"""A smooth surface through the nodes of a grid: cubic (Catmull-Rom) along rows and columns, once differentiable."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop

_STEPS = np.arange(-1, 3)[:, None]


def on_grid(axes: np.ndarray, places: np.ndarray, *, closed: bool) -> np.ndarray:
    """Return points (n, 3) m of the surface through nodes ``axes`` (3, rows, columns) m at (row, column) places (2, n).

    axes : contiguous
    closed : whether the last column joins the first; places beyond other ends lie on them
    """
    return _points_on_grid(axes, np.ascontiguousarray(places, float), closed)


def stencil(shape: tuple[int, int], places: np.ndarray, *, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (4, 4, n), as row * columns + column, and weights that give each place (2, n)."""
    rows, columns = shape
    ends = np.array([[rows - 1], [columns - 1]])
    held = np.minimum(np.maximum(places, 0), ends)
    if closed:
        held[1] = places[1]
    cell = np.floor(held).astype(int)
    cell[0] = np.minimum(cell[0], rows - 2)
    if not closed:
        cell[1] = np.minimum(cell[1], columns - 2)
    along, across = catmull_rom(held - cell).swapaxes(0, 1)
    at_row = np.minimum(np.maximum(cell[0] + _STEPS, 0), rows - 1)
    at_column = cell[1] + _STEPS
    at_column = at_column % columns if closed else np.minimum(np.maximum(at_column, 0), columns - 1)
    return at_row[:, None] * columns + at_column, along[:, None] * across


def catmull_rom(t: np.ndarray | float) -> np.ndarray:
    """Return the weights (4, ...) of the nodes -1, 0, 1, 2 at places t between 0 and 1: cubic, once differentiable."""
    square = t * t
    cube = square * t  # numpy's general power takes ten times as long
    return np.array([
        -t / 2 + square - cube / 2,
        1 - 2.5 * square + 1.5 * cube,
        t / 2 + 2 * square - 1.5 * cube,
        (cube - square) / 2,
    ])  # fmt: skip


@Loop
def _points_on_grid(axes, places, closed):  # noqa: ANN001, ANN202
    """See ``on_grid``."""
    rows, columns = axes.shape[1], axes.shape[2]
    points, along, across = np.empty((places.shape[1], 3)), np.empty(4), np.empty(4)
    for p in range(places.shape[1]):
        row = min(max(places[0, p], 0.0), float(rows - 1))
        column = places[1, p] if closed else min(max(places[1, p], 0.0), float(columns - 1))
        first_row, first_column = min(int(np.floor(row)), rows - 2), int(np.floor(column))
        if not closed:
            first_column = min(first_column, columns - 2)
        for t, weights in ((row - first_row, along), (column - first_column, across)):
            square = t * t
            cube = square * t
            weights[0] = -t / 2 + square - cube / 2
            weights[1] = 1 - 2.5 * square + 1.5 * cube
            weights[2] = t / 2 + 2 * square - 1.5 * cube
            weights[3] = (cube - square) / 2
        for axis in range(3):
            total = 0.0
            for i in range(4):
                a = min(max(first_row + i - 1, 0), rows - 1)
                for j in range(4):
                    b = first_column + j - 1
                    b = b % columns if closed else min(max(b, 0), columns - 1)
                    total += (along[i] * across[j]) * axes[axis, a, b]
            points[p, axis] = total
    return points
