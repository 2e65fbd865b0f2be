"""The gel's shape under a pressed ball, its print: not a sphere cut out, but with the shoulder of a bonded layer.

The rise of the gel comes from the project's axisymmetric finite-strain solver: balls of a few sizes on a disc of the
DIGIT's thickness and half-width, frictionless, tabulated over depth (``make_ball_print.py``). On another layer all
lengths scale with its thickness. Between two tabulated balls the prints are interpolated; for a ball larger than all,
the largest one's lengths are scaled, which neglects that the layer is then relatively thinner."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...files.shipped import shipped
from ...geometry.cubic_spline import EvenSpline, bspline_weights

TABLE = shipped("ball_print.npz")
LAYER = 4.06e-3  # m, thickness of the layer that was pressed: the DIGIT's
SPHERE_TO = 0.9  # of the radius: beyond, the profile continues as a cone, since the sphere's turns vertical


@dataclasses.dataclass(frozen=True)
class _Table:
    """Prints of one ball. radius : m; depths : (n,) m, to which it was pressed
    coefficients : (n, k), a row for each depth, of the spline of rise / depth over distance / sqrt(2 radius depth)"""

    radius: float
    depths: np.ndarray
    spline: EvenSpline
    coefficients: np.ndarray

    def rise(self, distance: np.ndarray, depth: float, radius: float) -> np.ndarray:
        """Return a flat layer's rise (...) m at distance (...) m from the axis of a ball of a radius and at a depth, m.
        The table's ball has ``self.radius``: all lengths are scaled by the ratio of the two radii."""
        scale = radius / self.radius
        distance, depth = distance / scale, depth / scale
        k = int(np.clip(np.searchsorted(self.depths, depth) - 1, 0, len(self.depths) - 2))
        part = np.clip((depth - self.depths[k]) / (self.depths[k + 1] - self.depths[k]), 0, 1)
        mixed = ((1 - part) * self.coefficients[k] + part * self.coefficients[k + 1]).astype(np.float32)
        cell, place = self.spline.cells(distance.ravel() / np.sqrt(2 * self.radius * depth))
        weights = bspline_weights(place.astype(np.float32))
        rise = sum(weight * mixed.take(cell + i) for i, weight in enumerate(weights))
        return scale * (depth * rise.reshape(distance.shape))


def print_on(
    rest: np.ndarray,
    right: np.ndarray,
    down: np.ndarray,
    ball: tuple[float, float, float, float],
    thickness: float = LAYER,
) -> np.ndarray:
    """Return the heights (H, W) float32, m, of a gel under a ball.

    rest : (H, W) m, heights before; right, down : (H, W) m, image frame; thickness : m, the gel's
    ball : right, down of its centre, depth from first touch, radius, m
    The dome changes the gap g between ball and gel. A point rises like that of a flat layer at the radius with the same
    gap g under the ball: inside the contact the gel then lies on the sphere exactly."""
    at_right, at_down, depth, radius = ball
    gap = _profile(np.hypot(right - at_right, down - at_down), radius) + rest
    gap -= gap.min()
    distance = _radius_of(gap, radius)
    rise = sum(share * table.rise(distance, depth, radius) for table, share in _tables_near(radius, thickness))
    return (rest + rise).astype(np.float32)


def deepest(radius: float, thickness: float = LAYER) -> float:
    """Return the depth, m, to which prints of a ball of a radius, m, are tabulated on a gel of a thickness, m."""
    near = _tables_near(radius, thickness)
    return sum(share * radius / table.radius * float(table.depths[-1]) for table, share in near)


def _tables_near(radius: float, thickness: float) -> list[tuple[_Table, float]]:
    """Return the tables next in size to a ball of a radius, m, on a layer of a thickness, m, each with its weight:
    linear in the logarithm of radius over thickness, sum 1. A table of weight 0 is left out."""
    tables = _tables()
    sizes = np.log([table.radius for table in tables])
    place = np.interp(np.log(radius * (LAYER / thickness)), sizes, np.arange(len(tables)))
    below = int(place)
    shares = [(below, 1 - (place - below)), (below + 1, place - below)]
    return [(tables[k], share) for k, share in shares if share > 0]


def _profile(distance: np.ndarray, radius: float) -> np.ndarray:
    """Return the height (...) m of a ball's underside over its lowest point, distance (...) m from its axis. radius :
    m"""
    edge = SPHERE_TO * radius
    inner = np.minimum(distance, edge)
    fall = np.sqrt(radius**2 - inner**2)
    return radius - fall + (distance - inner) * edge / np.sqrt(radius**2 - edge**2)


def _radius_of(gap: np.ndarray, radius: float) -> np.ndarray:
    """Invert ``_profile``: return the distance (...) m from the axis at which a ball's underside is ``gap`` (...) m
    over its lowest point. radius : m"""
    edge = SPHERE_TO * radius
    fall = np.sqrt(radius**2 - edge**2)
    inner = np.minimum(gap, radius - fall)
    return np.sqrt(inner * (2 * radius - inner)) + (gap - inner) * fall / edge


@functools.cache
def _tables() -> tuple[_Table, ...]:
    """Return the prints of all tabulated balls, the smallest first."""
    with np.load(TABLE, allow_pickle=False) as table:
        step = float(table["step"])
        found = [(float(radius), table[f"depth_{k}"], table[f"rise_{k}"]) for k, radius in enumerate(table["radius"])]
    splines = [EvenSpline(0.0, step, rise.shape[1]) for _, _, rise in found]
    parts = zip(found, splines, strict=True)
    return tuple(
        _Table(radius, depth, spline, rise @ spline.to_coefficients.T) for (radius, depth, rise), spline in parts
    )
