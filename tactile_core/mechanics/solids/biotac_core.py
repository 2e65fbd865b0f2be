"""The BioTac's rigid core as an obstacle: a smooth gap that the inner skin may close but not pass."""

from __future__ import annotations

import functools

import numpy as np

from ...sensors import biotac

# The part of the profile table where every ray meets the core, and a little more than the pad.
_X = -18.9e-3, 5.0e-3
_THETA = np.radians(120.0)
_ROUGHNESS = 10e-6  # m rms, the table's facets, which the spline smooths away (assumed: half of the skin's 20 um fit)
_HESSIAN_STEP = 1e-6  # m, of the differences of the exact gradient
_POINT_STEP = (0.05e-3, np.radians(1.0))  # m and rad between points that stand for the core: at most 0.09 mm apart


class BiotacCore:
    """Gap and normal of the core's surface r = R(x, theta) about the axis (y, z) = (``AXIS_Y``, 0)."""

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gap (n,) m, positive outside, and outward unit normal (n, 3) of the core at points (n, 3) m.

        The gap is (r - R) / |grad (r - R)|: exact to first order, and with that normal where it is closed.
        Beyond the table's ends the last radius is held.
        """
        x, y, z = points.T
        x = np.clip(x, *_X)
        theta = np.clip(np.arctan2(z, biotac.AXIS_Y - y), -_THETA, _THETA)
        r = np.maximum(np.hypot(y - biotac.AXIS_Y, z), 1e-6)
        radius = _spline()
        along = (radius.ev(x, theta, dx=1) + radius.ev(x, -theta, dx=1)) / 2  # the core is even in z, the spline nearly
        around = (radius.ev(x, theta, dy=1) - radius.ev(x, -theta, dy=1)) / (2 * r)
        # d theta / d(y, z) = (sin, cos) / r of the angle, whose own direction outward is (-cos, sin)
        sine, cosine = np.sin(theta), np.cos(theta)
        gradient = np.column_stack([-along, -cosine - around * sine, sine - around * cosine])
        length = np.linalg.norm(gradient, axis=1)
        height = r - (radius.ev(x, theta) + radius.ev(x, -theta)) / 2
        return height / length, gradient / length[:, None]

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Derivative (n, 3, 3) 1/m of the normal, symmetric part, by central differences."""
        blocks = np.empty((len(points), 3, 3))
        for k, axis in enumerate(np.eye(3) * _HESSIAN_STEP):
            blocks[:, :, k] = self.distance(points + axis)[1] - self.distance(points - axis)[1]
        return (blocks + blocks.swapaxes(1, 2)) / (4 * _HESSIAN_STEP)


@functools.cache
def _spline():  # noqa: ANN202 (scipy is imported only where it is needed)
    """Radius m over x m and theta rad: a bicubic spline through the table, smoothed by its roughness."""
    import scipy.interpolate

    table = biotac._table()
    rows = (table["x"] > _X[0]) & (table["x"] < _X[1])
    columns = np.abs(table["theta"]) <= _THETA + 1e-9
    radius = table["core"][np.ix_(rows, columns)]
    if not np.isfinite(radius).all():
        raise ValueError("the core's table has holes")
    smoothing = radius.size * _ROUGHNESS**2
    return scipy.interpolate.RectBivariateSpline(table["x"][rows], table["theta"][columns], radius, s=smoothing)


def facing_core(nodes: np.ndarray) -> np.ndarray:
    """Mark the resting inner-skin nodes (n, 3) m that may come to touch the core: (n,) bool.

    Under the pad, within the table, and clear of the core by 0.1 mm: nearer ones lie beside it and hardly move.
    """
    x, y, z = nodes.T
    inside = (x > _X[0]) & (x < _X[1]) & (np.abs(np.arctan2(z, biotac.AXIS_Y - y)) < np.radians(100.0))
    return inside & (BiotacCore().distance(nodes)[0] > 0.1e-3)


@functools.cache
def above_core() -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (n, 3) from the core's nearest point to each node of the resting inner skin; distances (n,) m.

    On the sides too, where ``BiotacCore`` has no table.
    """
    import scipy.spatial

    points = biotac.skin_surface("inner").rest
    step, turn = _POINT_STEP
    x, theta = np.meshgrid(np.arange(-20e-3, 5.3e-3, step), np.arange(-np.pi, np.pi - turn / 2, turn), indexing="ij")
    x, theta = x.ravel(), theta.ravel()
    radius = biotac.core_radius(x, theta)
    core = np.column_stack([x, biotac.AXIS_Y - radius * np.cos(theta), radius * np.sin(theta)])
    core = core[np.isfinite(radius)]
    distance, nearest = scipy.spatial.cKDTree(core).query(points)
    return (points - core[nearest]) / np.maximum(distance, 1e-9)[:, None], distance
