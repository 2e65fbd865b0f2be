"""The compiled loop of ``HeightMapper``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def heights_above(  # noqa: ANN201
    coefficients, x, z, to_x, to_z, miss, start, step, tolerance, most_steps,  # noqa: ANN001
):  # fmt: skip
    """Return heights (n,) float32 m of the gel points that have moved to places x, z (n,) m, and the number not found.

    For each place Broyden's method finds where the point rested; its height is taken there. The cubic B-splines of
    ``geometry.cubic_spline.bspline_weights`` are written out.
    coefficients : (3, rows, columns), of the splines of sideways motion along x, along z and of the height
    to_x, to_z, miss : (2, n), rows of the inverse Jacobian and the residual of each place at the start
    start, step : (2,) m, of the coefficients' grid; tolerance : m, of the residual; most_steps : before giving up"""
    intervals = coefficients.shape[1] - 3, coefficients.shape[2] - 3
    heights, lost = np.empty(len(x), np.float32), 0
    u, v, found = np.empty(4), np.empty(4), np.empty(3, np.float32)
    for n in range(len(x)):
        source_x, source_z, miss_x, miss_z = x[n], z[n], miss[0, n], miss[1, n]
        xx, xz, zx, zz = to_x[0, n], to_x[1, n], to_z[0, n], to_z[1, n]
        for number in range(most_steps + 1):
            arrived = number == most_steps
            if arrived:
                lost += 1
            else:
                step_x, step_z = -(xx * miss_x + xz * miss_z), -(zx * miss_x + zz * miss_z)
                source_x += step_x
                source_z += step_z
                arrived = max(abs(miss_x), abs(miss_z)) <= tolerance
            row_place = min(max((source_x - start[0]) / step[0], 0.0), float(intervals[0]))
            column_place = min(max((source_z - start[1]) / step[1], 0.0), float(intervals[1]))
            row, column = min(int(row_place), intervals[0] - 1), min(int(column_place), intervals[1] - 1)
            for place, weights in ((row_place - row, u), (column_place - column, v)):
                back = 1 - place
                weights[0] = back * back * back / 6
                weights[1] = 2 / 3 - place * place * (1 - place / 2)
                weights[2] = 2 / 3 - back * back * (1 - back / 2)
                weights[3] = place * place * place / 6
            for k in range(2 if arrived else 0, 3 if arrived else 2):
                total = 0.0
                for i in range(4):
                    along = 0.0
                    for j in range(4):
                        along += coefficients[k, row + i, column + j] * v[j]
                    total += u[i] * along
                found[k] = total
            if arrived:
                heights[n] = found[2]
                break
            before_x, before_z = miss_x, miss_z
            miss_x, miss_z = source_x - x[n] + found[0], source_z - z[n] + found[1]
            change_x, change_z = miss_x - before_x, miss_z - before_z
            wanted_x, wanted_z = xx * change_x + xz * change_z, zx * change_x + zz * change_z
            along = step_x * wanted_x + step_z * wanted_z
            if along != 0:
                over_x, over_z = (step_x - wanted_x) / along, (step_z - wanted_z) / along
                row_x, row_z = step_x * xx + step_z * zx, step_x * xz + step_z * zz
                xx, xz, zx, zz = xx + over_x * row_x, xz + over_x * row_z, zx + over_z * row_x, zz + over_z * row_z
    return heights, lost
