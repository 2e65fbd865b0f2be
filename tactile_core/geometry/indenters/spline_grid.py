"""Smooth functions on regular grids: a tricubic B-spline, twice continuously differentiable.

One grid holds a body, or a fine one the part of it that may touch and a coarse one all of it.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

from ...files.compiled import Loop
from ...files.short_text import Summary
from ..cubic_spline import bspline_slopes, bspline_weights


@dataclasses.dataclass(frozen=True, repr=False)
class SplineGrid(Summary):
    """The spline sum_ijk c_ijk B(x - i) B(y - j) B(z - k), in units of ``spacing`` m from ``origin`` (3,) m.

    coefficients : (nx, ny, nz), 4 or more each way, in the unit of the values
    It is defined in the box that leaves out the outermost nodes. Beyond it the distance to the box is added: continuous
    and, for a body well inside of it, larger than zero, but its slope jumps at the box.
    """

    origin: np.ndarray
    spacing: float
    coefficients: np.ndarray

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the values (n,) and gradients (n, 3) a metre at points (n, 3) m."""
        known, beyond, away = self._split(points)
        sums = self._sums(known, 2)
        return sums[:, 0, 0, 0] + away, self._gradient(sums, beyond, away)

    def gradient_and_hessian(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the gradients (n, 3) a metre and second derivatives (n, 3, 3) a square metre at points (n, 3) m."""
        known, beyond, away = self._split(points)
        sums = self._sums(known, 3)
        hessian = np.empty((len(points), 3, 3))
        for i, j in itertools.product(range(3), range(3)):
            order = np.bincount([i, j], minlength=3)
            hessian[:, i, j] = sums[:, order[0], order[1], order[2]] / self.spacing**2
        outside = beyond != 0
        hessian *= ~outside[:, :, None] & ~outside[:, None, :]
        length = np.where(away > 0, away, 1)[:, None, None]
        hessian += (np.eye(3) * outside[:, None, :] - beyond[:, :, None] * beyond[:, None, :] / length**2) / length
        return self._gradient(sums, beyond, away), hessian

    def _gradient(self, sums: np.ndarray, beyond: np.ndarray, away: np.ndarray) -> np.ndarray:
        inner = np.stack([sums[:, 1, 0, 0], sums[:, 0, 1, 0], sums[:, 0, 0, 1]], axis=1) / self.spacing
        return np.where(beyond == 0, inner, beyond / np.where(away > 0, away, 1)[:, None])

    def _split(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nearest place (n, 3) in the box, in spacings; from there vector (n, 3) m and distance (n,) m."""
        place = (points - self.origin) / self.spacing
        known = np.clip(place, 1, np.array(self.coefficients.shape) - 2)
        beyond = (place - known) * self.spacing
        return known, beyond, np.linalg.norm(beyond, axis=1)

    def _sums(self, place: np.ndarray, orders: int) -> np.ndarray:
        """The spline's derivatives (n, orders, orders, orders) along x, y and z at places (n, 3) in spacings."""
        shape = np.array(self.coefficients.shape)
        cell = np.minimum(place.astype(np.intp), shape - 3)
        along = (place - cell).ravel()
        weights = np.stack([bspline_weights(along), bspline_slopes(along), _bends(along)][:orders])  # (orders, 4, 3 n)
        by_point = np.ascontiguousarray(weights.reshape(orders, 4, -1, 3).transpose(2, 3, 0, 1))
        return _spline_sums(self.coefficients, place, cell, by_point, orders)


def _bends(t: np.ndarray) -> np.ndarray:
    """Second derivatives of ``bspline_weights`` by t; (4, n)."""
    return np.stack([1 - t, 3 * t - 2, 1 - 3 * t, t])


@Loop
def _spline_sums(coefficients, place, cell, weights, orders):  # noqa: ANN001, ANN202
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


BAND = 1e-3  # m, over which the fine grid's values pass into the coarse one's, twice continuously differentiable


@dataclasses.dataclass(frozen=True, repr=False)
class TipGrid(Summary):
    """The spline ``fine`` up to the height z = ``top``, m, the spline ``coarse`` from BAND above it; see SplineGrid."""

    fine: SplineGrid
    coarse: SplineGrid
    top: float

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the values (n,) and gradients (n, 3) a metre at points (n, 3) m."""
        share, slope, _ = self._share(points[:, 2])
        (near, along), (far, beyond) = (grid.value_and_gradient(points) for grid in (self.fine, self.coarse))
        return near + share * (far - near), _mixed_gradient(along, beyond, share, slope * (far - near))

    def gradient_and_hessian(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the gradients (n, 3) a metre and second derivatives (n, 3, 3) a square metre at points (n, 3) m."""
        share, slope, bend = self._share(points[:, 2])
        apart = self.coarse.value_and_gradient(points)[0] - self.fine.value_and_gradient(points)[0]
        (along, near), (beyond, far) = (grid.gradient_and_hessian(points) for grid in (self.fine, self.coarse))
        hessian = near + share[:, None, None] * (far - near)
        across = slope[:, None] * (beyond - along)
        hessian[:, 2, :] += across
        hessian[:, :, 2] += across
        hessian[:, 2, 2] += bend * apart
        return _mixed_gradient(along, beyond, share, slope * apart), hessian

    def _share(self, height: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Share (n,) of the coarse grid at heights (n,) m, and its derivatives: a polynomial of degree five."""
        t = np.clip((height - self.top) / BAND, 0, 1)
        slope, bend = 30 * t**2 * (1 - t) ** 2, 60 * t * (1 - t) * (1 - 2 * t)
        return t**3 * (10 - 15 * t + 6 * t**2), slope / BAND, bend / BAND**2


def _mixed_gradient(along: np.ndarray, beyond: np.ndarray, share: np.ndarray, upward: np.ndarray) -> np.ndarray:
    gradient = along + share[:, None] * (beyond - along)
    gradient[:, 2] += upward
    return gradient
