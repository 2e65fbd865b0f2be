"""Compiled loops of fast pictures; the formulas stand in ``shading``, ``cast_shadows`` and ``perspective``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def lamp_light(  # noqa: ANN201
    position, strength, tangent, over_picture, near, height, square, tilt, slope_right, slope_down, own, normal,  # noqa: ANN001
    facing, distance, light,  # noqa: ANN001
):  # fmt: skip
    """Fill light (H, W) without shadows, what it is of, and return the box (4,) of pixels that may throw shadows.

    position : (3,) float32 m of the LED; strength : its squared distance, m2; tangent : m, see ``TANGENT``
    facing : cosine times distance times the normal's length, m; distance : (H, W), squared, m2
    box : first and last row and column; the first row beyond the last where there is none
    """
    rows, columns = near.shape
    first_row, last_row, first_column, last_column = rows, -1, columns, -1
    right, down, up = position[0], position[1], position[2]
    for row in range(rows):
        for column in range(columns):
            far = over_picture[row, column] * near[row, column]
            far += up * height[row, column]
            far *= np.float32(-2)
            far += square[row, column]
            far += strength
            faces = up * tilt[row, column]
            faces -= right * slope_right[row, column]
            faces -= down * slope_down[row, column]
            faces += own[row, column]
            if faces < tangent * normal[row, column]:
                first_row, last_row = min(first_row, row), max(last_row, row)
                first_column, last_column = min(first_column, column), max(last_column, column)
            facing[row, column], distance[row, column] = faces, far
            light[row, column] = max(faces, np.float32(0)) / (far * np.sqrt(far) * normal[row, column]) * strength
    return first_row, last_row, first_column, last_column


@Loop
def march(field, foot, distance, radii, steps, grid_step):  # noqa: ANN001, ANN201
    """See ``ShadowCaster._march``; distance : (columns,) m, radii : (rows, columns), steps : (k,) columns."""
    rows, columns = field.shape
    sight = np.empty((rows, columns), np.float32)
    horizon = np.empty(columns, np.float32)
    for row in range(rows):
        horizon[:] = -np.inf
        for step in steps:
            scale = np.float32(1 / (step * grid_step))
            for column in range(step, columns):
                rise = (field[row, column - step] - field[row, column]) * scale
                horizon[column] = max(horizon[column], rise)
        for column in range(columns):
            seen = ((foot - field[row, column]) / distance[column] - horizon[column]) * radii[row, column]
            sight[row, column] = min(max(seen, np.float32(-1)), np.float32(1))
    return sight


@Loop
def interpolate(values, row, column):  # noqa: ANN001, ANN201
    """See ``perspective.bilinear``."""
    height, width = values.shape
    found = np.empty(row.shape, np.float32)
    for a in range(row.shape[0]):
        for b in range(row.shape[1]):
            i, j = min(np.int32(row[a, b]), height - 2), min(np.int32(column[a, b]), width - 2)
            t, s = row[a, b] - np.float32(i), column[a, b] - np.float32(j)
            upper = values[i, j] + (values[i, j + 1] - values[i, j]) * s
            lower = values[i + 1, j] + (values[i + 1, j + 1] - values[i + 1, j]) * s
            found[a, b] = upper + (lower - upper) * t
    return found
