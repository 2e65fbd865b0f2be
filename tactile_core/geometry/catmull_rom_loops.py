"""The compiled loop of ``catmull_rom.on_grid``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def points_on_grid(axes, places, closed):  # noqa: ANN001, ANN201
    """See ``on_grid``: the same sums in the same order."""
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
