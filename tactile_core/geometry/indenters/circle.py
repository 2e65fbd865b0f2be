"""Distance from a circle about the z axis in the plane z = 0, in three dimensions."""

from __future__ import annotations

import numpy as np

from ...files.compiled import available
from .distance_loops import from_circle
from .indenter import NEAREST, contiguous


def circle_distance(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance (n,) m of points (n, 3) m from a circle of ``radius`` m, and its gradient (n, 3)."""
    if available():
        return from_circle(contiguous(points), radius, NEAREST)
    _, radial, arm, length = _arms(points, radius)
    gradient = np.empty((len(points), 3))
    gradient[:, :2], gradient[:, 2] = arm[:, :1] * radial, arm[:, 1]
    gradient /= length[:, None]
    return length, gradient


def circle_curvature(points: np.ndarray, radius: float) -> np.ndarray:
    """Return the second derivatives (n, 3, 3) 1/m of ``circle_distance``: 1 / length round the wire, and along it."""
    around, radial, arm, length = _arms(points, radius)
    turn = np.column_stack([-arm[:, 1:] * radial, arm[:, 0]])
    along = np.column_stack([-radial[:, 1], radial[:, 0], np.zeros(len(points))])
    hoop = arm[:, 0] / length / np.maximum(around, NEAREST)
    return _square(turn) / length[:, None, None] ** 3 + hoop[:, None, None] * _square(along)


def _arms(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Distance (n,) m from the axis, direction from it (n, 2), arm from the circle (n, 2) m, its length (n,) m."""
    across = points[:, :2]
    around = np.sqrt(np.einsum("ni,ni->n", across, across))
    if around.min(initial=np.inf) >= NEAREST:
        radial = across / around[:, None]
    else:
        radial = across / np.maximum(around, NEAREST)[:, None]
        radial[around < NEAREST] = [1.0, 0.0]
    arm = np.empty((len(points), 2))
    arm[:, 0], arm[:, 1] = around - radius, points[:, 2]
    length = np.sqrt(np.einsum("ni,ni->n", arm, arm))
    if length.min(initial=np.inf) < NEAREST:
        arm[length < NEAREST] = [0.0, -NEAREST]
        length = np.maximum(length, NEAREST)
    return around, radial, arm, length


def _square(vectors: np.ndarray) -> np.ndarray:
    """The outer product (n, 3, 3) of each vector (n, 3) with itself."""
    return vectors[:, :, None] * vectors[:, None, :]
