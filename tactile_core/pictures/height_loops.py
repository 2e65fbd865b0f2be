"""A compiled loop of ``HeightMapper``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def look_up(coefficients, row, t, column, s):  # noqa: ANN001, ANN201
    """Splines (k, rows, columns) at places (n,): t, s of the way through cells row, column; (n, k) float32.

    The cubic B-splines of ``geometry.cubic_spline.bspline_weights``, written out.
    """
    kinds = coefficients.shape[0]
    found = np.empty((len(row), kinds), np.float32)
    u, v = np.empty(4), np.empty(4)
    for n in range(len(row)):
        for place, weights in ((t[n], u), (s[n], v)):
            back = 1 - place
            weights[0] = back * back * back / 6
            weights[1] = 2 / 3 - place * place * (1 - place / 2)
            weights[2] = 2 / 3 - back * back * (1 - back / 2)
            weights[3] = place * place * place / 6
        for k in range(kinds):
            total = 0.0
            for i in range(4):
                along = 0.0
                for j in range(4):
                    along += coefficients[k, row[n] + i, column[n] + j] * v[j]
                total += u[i] * along
            found[n, k] = total
    return found
