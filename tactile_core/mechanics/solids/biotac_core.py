"""A fluid sensor's rigid core as an obstacle: a smooth gap that the inner skin may close but not pass."""

from __future__ import annotations

import functools

import numpy as np

from ...errors import TactileError
from ...sensors import skin_of

_ROUGHNESS = 10e-6  # m rms, of the table, which the spline smooths away (assumed: half of the skin's 20 um fit)
_HESSIAN_STEP = 1e-6  # m, of the differences of the exact gradient
_POINT_STEP = (0.05e-3, np.radians(1.0))  # m and rad between points that stand for the core: at most 0.09 mm apart


class Core:
    """Gap and normal of a core's surface r = R(x, theta), tabulated about the axis (y, z) = (``axis_y``, 0)."""

    def __init__(self, sensor: str) -> None:
        self.sensor, self._skin = sensor, skin_of(sensor)

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the gap (n,) m, positive outside, and outward unit normal (n, 3) of the core at points (n, 3) m.

        The gap is (r - R) / |grad (r - R)|, exact to first order, as is the normal at closed gaps. Beyond the table's
        ends its last radius is used."""
        x, y, z = points.T
        axis_y, core = self._skin.axis_y, self._skin.descriptor.core
        x = np.clip(x, *core.contact_x)
        theta = np.clip(np.arctan2(z, axis_y - y), -core.contact_half_angle, core.contact_half_angle)
        r = np.maximum(np.hypot(y - axis_y, z), 1e-6)
        radius = _spline(self.sensor)
        along = (radius.ev(x, theta, dx=1) + radius.ev(x, -theta, dx=1)) / 2  # the core is even in z, the spline nearly
        around = (radius.ev(x, theta, dy=1) - radius.ev(x, -theta, dy=1)) / (2 * r)
        # d theta / d(y, z) = (sin, cos) / r of the angle, whose own direction outward is (-cos, sin)
        sine, cosine = np.sin(theta), np.cos(theta)
        gradient = np.column_stack([-along, -cosine - around * sine, sine - around * cosine])
        length = np.linalg.norm(gradient, axis=1)
        height = r - (radius.ev(x, theta) + radius.ev(x, -theta)) / 2
        return height / length, gradient / length[:, None]

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the normal's derivative (n, 3, 3) 1/m at points (n, 3) m, symmetric part, by central differences."""
        blocks = np.empty((len(points), 3, 3))
        for k, axis in enumerate(np.eye(3) * _HESSIAN_STEP):
            blocks[:, :, k] = self.distance(points + axis)[1] - self.distance(points - axis)[1]
        return (blocks + blocks.swapaxes(1, 2)) / (4 * _HESSIAN_STEP)


@functools.cache
def _spline(sensor: str):  # noqa: ANN202 (scipy is imported only where it is needed)
    """Return the radius, m, over x, m, and theta, rad: a bicubic spline that smooths the table's roughness away."""
    import scipy.interpolate

    table, core = skin_of(sensor).table, skin_of(sensor).descriptor.core
    rows = (table["x"] > core.contact_x[0]) & (table["x"] < core.contact_x[1])
    columns = np.abs(table["theta"]) <= core.contact_half_angle + 1e-9
    radius = table["core"][np.ix_(rows, columns)]
    if not np.isfinite(radius).all():
        raise TactileError(skin_of(sensor).descriptor.folder, "holes in the core's table", "a core within contact_x_mm")
    smoothing = radius.size * _ROUGHNESS**2
    return scipy.interpolate.RectBivariateSpline(table["x"][rows], table["theta"][columns], radius, s=smoothing)


def facing_core(sensor: str, nodes: np.ndarray) -> np.ndarray:
    """Mark (n,) bool the resting inner-skin nodes (n, 3) m that may come to touch the core.

    They lie in the descriptor's ranges of x and angle, over 0.1 mm off: nearer ones are beside it and hardly move."""
    x, y, z = nodes.T
    skin = skin_of(sensor)
    (low, high), half = skin.descriptor.core.contact_x, skin.descriptor.core.facing_half_angle
    inside = (x > low) & (x < high) & (np.abs(np.arctan2(z, skin.axis_y - y)) < half)
    return inside & (Core(sensor).distance(nodes)[0] > 0.1e-3)


@functools.cache
def above_core(sensor: str) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors (n, 3) from the core's nearest point to each node of the resting inner skin, and distances
    (n,) m; on the sides too, where ``Core`` has no table."""
    import scipy.spatial

    skin = skin_of(sensor)
    points = skin.skin_surface("inner").rest
    step, turn = _POINT_STEP
    tip, base = skin.descriptor.skin.inner_poles
    grids = np.meshgrid(
        np.arange(np.floor(1e3 * tip) / 1e3, base + 0.2e-3, step),
        np.arange(-np.pi, np.pi - turn / 2, turn),
        indexing="ij",
    )
    x, theta = (each.ravel() for each in grids)
    radius = skin.core_radius(x, theta)
    core = np.column_stack([x, skin.axis_y - radius * np.cos(theta), radius * np.sin(theta)])
    core = core[np.isfinite(radius)]
    distance, nearest = scipy.spatial.cKDTree(core).query(points)
    return (points - core[nearest]) / np.maximum(distance, 1e-9)[:, None], distance
