"""A compiled loop of ``SplineGrid``."""

from __future__ import annotations

import numpy as np

from ...files.compiled import Loop


@Loop
def spline_sums(coefficients, place, cell, weights, orders):  # noqa: ANN001, ANN201
    """Sum the spline's derivatives (n, orders, orders, orders) in cells (n, 3); weights : (n, 3, orders, 4) by axis."""
    sums = np.zeros((len(place), orders, orders, orders))
    along, flat = np.zeros(3), np.zeros((3, 3))
    for p in range(len(place)):
        for a in range(4):
            for i in range(orders):
                for j in range(orders):
                    flat[i, j] = 0.0
            for b in range(4):
                for j in range(orders):
                    along[j] = 0.0
                for c in range(4):
                    value = coefficients[cell[p, 0] + a - 1, cell[p, 1] + b - 1, cell[p, 2] + c - 1]
                    for j in range(orders):
                        along[j] += value * weights[p, 2, j, c]
                for i in range(orders):
                    for j in range(orders):
                        flat[i, j] += weights[p, 1, i, b] * along[j]
            for h in range(orders):
                for i in range(orders):
                    for j in range(orders):
                        sums[p, h, i, j] += weights[p, 0, h, a] * flat[i, j]
    return sums
