"""Compiled loops of what a camera sees of a height map; the formulas stand in ``perspective`` and ``shading``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def slope_maps(height, over_right, over_down):  # noqa: ANN001, ANN201
    """See ``perspective.slopes``; over_right, over_down : float32, half of 1 over the pixels' sizes, 1/m."""
    rows, columns = height.shape
    right, down = np.empty((rows, columns), np.float32), np.empty((rows, columns), np.float32)
    three, four = np.float32(3), np.float32(4)
    for a in range(rows):
        line = height[a]
        for b in range(1, columns - 1):
            right[a, b] = (line[b + 1] - line[b - 1]) * over_right
        right[a, 0] = (four * line[1] - three * line[0] - line[2]) * over_right
        right[a, columns - 1] = (three * line[columns - 1] - four * line[columns - 2] + line[columns - 3]) * over_right
        if 0 < a < rows - 1:
            for b in range(columns):
                down[a, b] = (height[a + 1, b] - height[a - 1, b]) * over_down
    last = rows - 1
    for b in range(columns):
        down[0, b] = (four * height[1, b] - three * height[0, b] - height[2, b]) * over_down
        down[last, b] = (three * height[last, b] - four * height[last - 1, b] + height[last - 2, b]) * over_down
    return right, down


@Loop
def weigh_slopes(slope_right, slope_down, right, down):  # noqa: ANN001, ANN201
    """See ``Perspective._steepness``, into ``slope_right``, and its least; right (W,), down (H,) over the height."""
    least = np.float32(np.inf)
    for a in range(slope_right.shape[0]):
        for b in range(slope_right.shape[1]):
            steep = slope_right[a, b] * right[b] + slope_down[a, b] * down[a]
            slope_right[a, b] = steep
            least = min(least, steep)
    return least


@Loop
def seen_heights(height, steepness, start, start_near, start_nearest, rows, columns, inverse):  # noqa: ANN001, ANN201
    """See ``Perspective.__call__``; rows (H,), columns (W,) from the map's middle; inverse : 1/m, of the camera's."""
    count, width = height.shape
    middle_row, middle_column = np.float32((count - 1) / 2), np.float32((width - 1) / 2)
    last_row, last_column = np.float32(2) * middle_row, np.float32(2) * middle_column
    one, half, least = np.float32(1), np.float32(0.5), np.float32(0)
    flat_height, flat_steepness, found = height.ravel(), steepness.ravel(), np.empty_like(height)
    turn, there, near, seen, row, column = np.empty((6, width), np.float32)  # by row: half the time of by pixel
    for a in range(count):
        for b in range(width):
            turn[b], there[b] = flat_steepness[start_nearest[a, b]], flat_height[start_nearest[a, b]]
        for b in range(width):
            share = turn[b] / start_near[a, b]
            seen[b] = (there[b] + share * start[a, b]) / (one + share)
            near[b] = one - seen[b] * inverse
            row[b] = min(max(near[b] * rows[a] + middle_row, least), last_row)
            column[b] = min(max(near[b] * columns[b] + middle_column, least), last_column)
        for b in range(width):
            turn[b] = flat_steepness[np.intp(row[b] + half) * width + np.intp(column[b] + half)]
            i, j = min(np.intp(row[b]), count - 2), min(np.intp(column[b]), width - 2)
            t, s, at = row[b] - np.float32(i), column[b] - np.float32(j), i * width + j
            upper = flat_height[at] + (flat_height[at + 1] - flat_height[at]) * s
            lower = flat_height[at + width] + (flat_height[at + width + 1] - flat_height[at + width]) * s
            there[b] = upper + (lower - upper) * t
        for b in range(width):
            share = turn[b] / near[b]
            found[a, b] = (there[b] + share * seen[b]) / (one + share)
    return found


@Loop
def seen_surface(seen, slope_right, slope_down, right, down, inverse):  # noqa: ANN001, ANN201
    """Compute near, tilt, own, normal, square and mapped, (6, H, W) float32, of ``shading.SeenSurface``."""
    rows, columns = seen.shape
    found, one = np.empty((6, rows, columns), np.float32), np.float32(1)
    for a in range(rows):
        for b in range(columns):
            x, y, height = slope_right[a, b], slope_down[a, b], seen[a, b]
            near = one - height * inverse
            outward = right[b] * x + down[a] * y
            tilt = near - outward * inverse
            found[0, a, b], found[1, a, b] = near, tilt
            found[2, a, b] = outward * near - tilt * height
            found[3, a, b] = np.sqrt(x * x + y * y + tilt * tilt)
            found[4, a, b] = near * near * (right[b] * right[b] + down[a] * down[a]) + height * height
            found[5, a, b] = height / near
    return found
