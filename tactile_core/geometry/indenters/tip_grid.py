"""A fine grid of the part of a body that may touch, and a coarse one of all of it."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...files.short_text import Summary
from .spline_grid import SplineGrid

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
