"""Smooth functions on regular grids: a tricubic B-spline, twice continuously differentiable.

A body has one grid, or a fine one for the part of it that may touch and a coarse one for all of it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ...files.compiled import Loop
from ...files.short_text import Summary
from .indenter import contiguous


@dataclasses.dataclass(frozen=True, repr=False)
class SplineGrid(Summary):
    """The spline sum_ijk c_ijk B(x - i) B(y - j) B(z - k), in units of ``spacing`` m from ``origin`` (3,) m.

    coefficients : (nx, ny, nz), 4 or more each way, in the unit of the values
    It is defined in the box without the outermost nodes. Beyond, the distance to the box is added: the value stays
    continuous and, for a body well inside, positive; its slope jumps at the box.
    """

    origin: np.ndarray
    spacing: float
    coefficients: np.ndarray

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the values (n,) and gradients (n, 3) per metre at points (n, 3) m."""
        return _spline(contiguous(points), self.origin, self.spacing, self.coefficients, False)[:2]

    def gradient_and_hessian(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gradients (n, 3) per metre and second derivatives (n, 3, 3) per square metre at points (n, 3) m."""
        return _spline(contiguous(points), self.origin, self.spacing, self.coefficients, True)[1:]


@Loop
def _spline(points, origin, spacing, coefficients, bends):  # noqa: ANN001, ANN202
    """Return, for points (n, 3) m, a ``SplineGrid``'s value (n,), gradient (n, 3) and, if ``bends``, second derivatives
    (n, 3, 3), else (0, 3, 3)."""
    value, gradient = np.empty(len(points)), np.empty((len(points), 3))
    hessian = np.zeros((len(points) if bends else 0, 3, 3))
    cell, beyond, weights, sums = np.zeros(3, np.int64), np.zeros(3), np.zeros((3, 3, 4)), np.zeros(10)
    for p in range(len(points)):
        square = 0.0
        for i in range(3):
            place = (points[p, i] - origin[i]) / spacing
            known = min(max(place, 1.0), coefficients.shape[i] - 2.0)
            beyond[i] = (place - known) * spacing
            square += beyond[i] * beyond[i]
            cell[i] = min(int(known), coefficients.shape[i] - 3)
            t = known - cell[i]
            s = 1 - t
            # The four B-splines, their slopes and bends, by t.
            weights[i, 0, 0], weights[i, 0, 1] = s * s * s / 6, 2 / 3 - t * t * (1 - t / 2)
            weights[i, 0, 2], weights[i, 0, 3] = 2 / 3 - s * s * (1 - s / 2), t * t * t / 6
            weights[i, 1, 0], weights[i, 1, 1] = -s * s / 2, (3 * t * t - 4 * t) / 2
            weights[i, 1, 2], weights[i, 1, 3] = (4 * s - 3 * s * s) / 2, t * t / 2
            weights[i, 2, 0], weights[i, 2, 1], weights[i, 2, 2], weights[i, 2, 3] = s, 3 * t - 2, 1 - 3 * t, t
        x, y, z = weights[0], weights[1], weights[2]
        i, j, k = cell[0], cell[1], cell[2]
        block = coefficients[i - 1 : i + 3, j - 1 : j + 3, k - 1 : k + 3]  # one look for negative indices, not 64
        sums[:] = 0.0  # value; along x, y, z; xx, yy, zz, xy, xz, yz
        for a in range(4):
            flat, flat_y, flat_z, flat_yy, flat_yz, flat_zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for b in range(4):
                along, along_z, along_zz = 0.0, 0.0, 0.0
                for c in range(4):
                    along += block[a, b, c] * z[0, c]
                    along_z += block[a, b, c] * z[1, c]
                flat += y[0, b] * along
                flat_y += y[1, b] * along
                flat_z += y[0, b] * along_z
                if bends:
                    for c in range(4):
                        along_zz += block[a, b, c] * z[2, c]
                    flat_yy += y[2, b] * along
                    flat_yz += y[1, b] * along_z
                    flat_zz += y[0, b] * along_zz
            sums[0] += x[0, a] * flat
            sums[1] += x[1, a] * flat
            sums[2] += x[0, a] * flat_y
            sums[3] += x[0, a] * flat_z
            sums[4] += x[2, a] * flat
            sums[5] += x[0, a] * flat_yy
            sums[6] += x[0, a] * flat_zz
            sums[7] += x[1, a] * flat_y
            sums[8] += x[1, a] * flat_z
            sums[9] += x[0, a] * flat_yz
        away = np.sqrt(square)
        value[p] = sums[0] + away
        for i in range(3):
            gradient[p, i] = sums[1 + i] / spacing if beyond[i] == 0 else beyond[i] / away
            if not bends:
                continue
            for j in range(3):
                if beyond[i] == 0 and beyond[j] == 0:
                    hessian[p, i, j] = sums[4 + i if i == j else 6 + i + j] / (spacing * spacing)
                elif beyond[i] != 0 and beyond[j] != 0:
                    hessian[p, i, j] = ((i == j) - beyond[i] * beyond[j] / square) / away
    return value, gradient, hessian


BAND = 1e-3  # m, over which the fine grid's values pass into the coarse one's, twice continuously differentiable


@dataclasses.dataclass(frozen=True, repr=False)
class TipGrid(Summary):
    """Two ``SplineGrid``: ``fine`` up to the height z = ``top``, m, ``coarse`` from 1 mm (``BAND``) above that, and in
    between a smooth passage from one to the other."""

    fine: SplineGrid
    coarse: SplineGrid
    top: float

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the values (n,) and gradients (n, 3) per metre at points (n, 3) m."""
        if not (points[:, 2] > self.top).any():
            return self.fine.value_and_gradient(points)
        share, slope, _ = self._share(points[:, 2])
        (near, along), (far, beyond) = (grid.value_and_gradient(points) for grid in (self.fine, self.coarse))
        return near + share * (far - near), _mixed_gradient(along, beyond, share, slope * (far - near))

    def gradient_and_hessian(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gradients (n, 3) per metre and second derivatives (n, 3, 3) per square metre at points (n, 3) m."""
        if not (points[:, 2] > self.top).any():
            return self.fine.gradient_and_hessian(points)
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
        """Return the coarse grid's share (n,) at height z (n,) m, a polynomial of degree 5, and two derivatives."""
        t = np.clip((height - self.top) / BAND, 0, 1)
        slope, bend = 30 * t**2 * (1 - t) ** 2, 60 * t * (1 - t) * (1 - 2 * t)
        return t**3 * (10 - 15 * t + 6 * t**2), slope / BAND, bend / BAND**2


def _mixed_gradient(along: np.ndarray, beyond: np.ndarray, share: np.ndarray, upward: np.ndarray) -> np.ndarray:
    gradient = along + share[:, None] * (beyond - along)
    gradient[:, 2] += upward
    return gradient
