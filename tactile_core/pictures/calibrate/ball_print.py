"""The gel under a pressed ball: not a sphere cut out, but a print with the shoulder of a bonded layer around it.

The rise of the gel comes from the project's own mechanics: the axisymmetric finite-strain solver, a 6 mm ball on a
disc of the gel's thickness and half-width, frictionless, tabulated over depth (``make_ball_print.py``).
Balls of other sizes scale all lengths, which leaves out that the layer is then relatively thinner or thicker.
"""

from __future__ import annotations

import functools

import numpy as np

from ...files.shipped import shipped
from ...geometry.cubic_spline import EvenSpline, bspline_weights

TABLE = shipped("ball_print.npz")
TABLE_RADIUS = 3e-3  # m, of the ball that was tabulated
SPHERE_TO = 0.9  # of the radius: beyond, the ball's profile goes on as a cone, for the gap to it is no function there


def print_on(
    rest: np.ndarray, right: np.ndarray, down: np.ndarray, ball: tuple[float, float, float, float]
) -> np.ndarray:
    """Return the heights (H, W) float32, m, of gel at rest (H, W) m under a ball; right, down : (H, W) m, image frame.

    ball : right, down of its centre, depth from first touch, radius, m.
    The dome changes the gap g between ball and gel. The print is that of the flat layer at the radius where the flat
    gap is g: inside the contact the gel then lies on the sphere exactly.
    """
    at_right, at_down, depth, radius = ball
    gap = _profile(np.hypot(right - at_right, down - at_down), radius) + rest
    gap -= gap.min()
    scale = radius / TABLE_RADIUS
    rise = scale * _rise(_radius_of(gap, radius) / scale, depth / scale)
    return (rest + rise).astype(np.float32)


def _profile(distance: np.ndarray, radius: float) -> np.ndarray:
    """Height of the ball's lower side over its lowest point."""
    edge = SPHERE_TO * radius
    inner = np.minimum(distance, edge)
    fall = np.sqrt(radius**2 - inner**2)
    return radius - fall + (distance - inner) * edge / np.sqrt(radius**2 - edge**2)


def _radius_of(gap: np.ndarray, radius: float) -> np.ndarray:
    """Invert ``_profile``: the distance, m, from the axis where the ball is ``gap`` m above its lowest point."""
    edge = SPHERE_TO * radius
    fall = np.sqrt(radius**2 - edge**2)
    inner = np.minimum(gap, radius - fall)
    return np.sqrt(inner * (2 * radius - inner)) + (gap - inner) * fall / edge


def _rise(distance: np.ndarray, depth: float) -> np.ndarray:
    """Rise of the flat layer at distances from the axis, by the table; linear between depths."""
    depths, spline, coefficients = _table()
    k = int(np.clip(np.searchsorted(depths, depth) - 1, 0, len(depths) - 2))
    part = np.clip((depth - depths[k]) / (depths[k + 1] - depths[k]), 0, 1)
    mixed = ((1 - part) * coefficients[k] + part * coefficients[k + 1]).astype(np.float32)
    cell, place = spline.cells(distance.ravel() / np.sqrt(2 * TABLE_RADIUS * depth))
    weights = bspline_weights(place.astype(np.float32))
    rise = sum(weight * mixed.take(cell + i) for i, weight in enumerate(weights))
    return depth * rise.reshape(distance.shape)


@functools.cache
def _table() -> tuple[np.ndarray, EvenSpline, np.ndarray]:
    """Depths (n,) m, the spline over distance / sqrt(2 R depth), and coefficients (n, k) of rise / depth."""
    with np.load(TABLE, allow_pickle=False) as table:
        depths, step, rise = table["depth"], float(table["step"]), table["rise"]
    spline = EvenSpline(0.0, step, rise.shape[1])
    return depths, spline, rise @ spline.to_coefficients.T
