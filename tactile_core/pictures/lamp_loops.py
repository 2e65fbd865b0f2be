"""Compiled loops of fast pictures; the formulas stand in ``shading``, ``cast_shadows`` and ``perspective``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def light_of_lamps(  # noqa: ANN201
    seen, slope_right, slope_down, right, down, inverse, position, strength, tangent,  # noqa: ANN001
    near, tilt, normal, mapped, facing, distance, light,  # noqa: ANN001
):  # fmt: skip
    """Fill in the light (3, H, W) of all LEDs without shadows, and what it is of; return where shadows may begin.

    seen, slope_right, slope_down, near, tilt, normal, mapped : (H, W), see ``SeenSurface``; right (W,), down (H,) m
    inverse : 1/m, of the camera's apparent height; position : (3, 3) m of the LEDs; strength : (3,), squared distances
    from the middle, m2; tangent : (3,) m, see ``TANGENT``
    facing : (3, H, W) m, cosine times distance times the normal's length; distance : (3, H, W), squared, m2
    edges : (3, 4), first and last row and column of each LED; the first row beyond the last where there is none
    """
    rows, columns = seen.shape
    one, zero, two = np.float32(1), np.float32(0), np.float32(-2)
    own, square, edges = np.empty(columns, np.float32), np.empty(columns, np.float32), np.empty((3, 4), np.int64)
    edges[:, 0], edges[:, 1], edges[:, 2], edges[:, 3] = rows, -1, columns, -1
    for a in range(rows):  # a row stays in the processor's cache; loops without conditions are vectorised
        for b in range(columns):
            x, y, height = slope_right[a, b], slope_down[a, b], seen[a, b]
            nearness = one - height * inverse
            outward = right[b] * x + down[a] * y
            tilted = nearness - outward * inverse
            near[a, b], tilt[a, b] = nearness, tilted
            own[b] = outward * nearness - tilted * height
            normal[a, b] = np.sqrt(x * x + y * y + tilted * tilted)
            square[b] = nearness * nearness * (right[b] * right[b] + down[a] * down[a]) + height * height
            mapped[a, b] = height / nearness
        for led in range(3):
            aside, ahead, up = position[led, 0], position[led, 1], position[led, 2]
            begins, lower = False, down[a] * ahead
            for b in range(columns):
                far = (right[b] * aside + lower) * near[a, b]
                far += up * seen[a, b]
                far *= two
                far += square[b]
                far += strength[led]
                faces = up * tilt[a, b]
                faces -= aside * slope_right[a, b]
                faces -= ahead * slope_down[a, b]
                faces += own[b]
                facing[led, a, b], distance[led, a, b] = faces, far
                light[led, a, b] = max(faces, zero) / (far * np.sqrt(far) * normal[a, b]) * strength[led]
            for b in range(columns):
                begins |= facing[led, a, b] < tangent[led] * normal[a, b]
            if begins:
                edges[led, 0], edges[led, 1] = min(edges[led, 0], a), a
                for b in range(columns):
                    if facing[led, a, b] < tangent[led] * normal[a, b]:
                        edges[led, 2], edges[led, 3] = min(edges[led, 2], b), max(edges[led, 3], b)
    return edges


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
            before, here, highest = field[row, : columns - step], field[row, step:], horizon[step:]
            for column in range(columns - step):  # of slices alone, which is vectorised
                highest[column] = max(highest[column], (before[column] - here[column]) * scale)
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
