"""Compiled loops over a sensor's whole surface: rows of its compliance gathered, its motion and its correction."""

from __future__ import annotations

import numpy as np

from ...files.compiled import Loop


@Loop
def gather_rows(move, entries, at, rows, mirrored, columns, mirrored_columns):  # noqa: ANN001, ANN201
    """Fill the rows (3 n) of ``entries`` (3 n, 3 n) that belong to near nodes ``at`` (k,).

    move : (3 r, j) float32 m/N; rows : (n,), that answer each near node; mirrored : (n,) bool, by its image
    columns, mirrored_columns : (3 n,) of ``move``, of the near nodes and of their images
    """
    for each in at:
        flip = mirrored[each]
        for axis in range(3):
            source, out = move[3 * rows[each] + axis], entries[3 * each + axis]
            if not flip:
                for j in range(len(columns)):
                    out[j] = source[columns[j]]
                continue
            sign = np.float32(-1.0 if axis == 2 else 1.0)  # mirrored in z: of the force, and of the motion
            for j in range(0, len(columns), 3):
                out[j] = sign * source[mirrored_columns[j]]
                out[j + 1] = sign * source[mirrored_columns[j + 1]]
                out[j + 2] = -sign * source[mirrored_columns[j + 2]]


@Loop
def surface_motion(move, rows, mirrored, image, force, inner_move, inner, inner_force):  # noqa: ANN001, ANN201
    """Compute the displacement (3 n,) float32, m, of the whole surface; see ``surface_response.displacement``.

    rows : (k,) of ``move`` for each node; mirrored : (k,) bool; image : (n,), of every surface node
    """
    size = move.shape[1]
    moved, there = np.zeros(size, np.float32), np.zeros(size, np.float32)
    any_there = False
    for a in range(len(rows)):
        flip = mirrored[a]
        any_there |= flip
        out = there if flip else moved
        x, y = np.float32(force[a, 0]), np.float32(force[a, 1])
        z = np.float32(-force[a, 2] if flip else force[a, 2])
        first, second, third = move[3 * rows[a]], move[3 * rows[a] + 1], move[3 * rows[a] + 2]
        for j in range(size):
            out[j] += x * first[j] + y * second[j] + z * third[j]
    for p in range(len(inner)):
        line, load = inner_move[inner[p]], np.float32(inner_force[p])
        for j in range(size):
            moved[j] += load * line[j]
    if any_there:
        for node in range(len(image)):
            other = 3 * image[node]
            moved[3 * node] += there[other]
            moved[3 * node + 1] += there[other + 1]
            moved[3 * node + 2] -= there[other + 2]
    return moved


@Loop
def add_field(displacement, plane, frames, centre, radius, reach, lines, field, scale):  # noqa: ANN001, ANN201
    """``displacement`` (n, 3) plus ``scale`` times a field on a grid, float64; see ``correction.spread_field``."""
    moved, per_line = np.empty(displacement.shape), (lines - 1) / 2 / np.arcsinh(reach)
    middle = (lines - 1) / 2
    for node in range(len(plane)):
        x, z = (plane[node, 0] - centre[0]) / radius, (plane[node, 1] - centre[1]) / radius
        for i in range(3):
            moved[node, i] = displacement[node, i]
        if max(abs(x), abs(z)) >= reach:
            continue
        u, v = np.arcsinh(x) * per_line + middle, np.arcsinh(z) * per_line + middle
        row, column = min(int(u), lines - 2), min(int(v), lines - 2)
        u, v = u - row, v - column
        corner = row * lines + column
        for j in range(3):
            local = (1 - v) * ((1 - u) * field[corner, j] + u * field[corner + lines, j])
            local += v * ((1 - u) * field[corner + 1, j] + u * field[corner + lines + 1, j])
            for i in range(3):
                moved[node, i] += scale * frames[i, j, node] * local
    return moved
