"""Heights and reflectance that pixels show of gel under a body whose shape, pose and texture are known.

Contact is solved at nodes; between them the surface's spline dips into details finer than their spacing: an edge, a
letter, a groove. No gel is inside a rigid body: there its heights are the body's own, at each pixel."""

from __future__ import annotations

import numpy as np

from ..geometry.indenters import Indenter, Pose
from ..sensors.camera import Camera
from .height_map import MOVE_TOLERANCE
from .perspective import lookup

_ROUNDS = 20  # of Newton's method, at most: a few for most pixels; at upright walls 4 um may be left
_LEAST_SLOPE = 0.2  # of the distance along +y, by which a step is divided: a surface 80 degrees steep
_BEYOND = 1e-3  # m, beyond the outermost nodes that touch: a ball of 150 mm radius dips into the spline that far out

_ALL = slice(None)


def out_of_body(
    heights: np.ndarray, camera: Camera, indenter: Indenter, pose: Pose, touching: np.ndarray
) -> np.ndarray:
    """Return heights (H, W) float32, m, with gel that is inside the body moved along +y onto its surface.

    heights : (H, W) m, of ``HeightMapper`` for the same camera; pose : of the body, in the sensor's frame
    touching : (k, 3) m, the displaced nodes that touch; pixels outside their bounding box keep their heights"""
    rows, columns = (
        np.flatnonzero((seen > places.min(initial=np.inf) - _BEYOND) & (seen < places.max(initial=-np.inf) + _BEYOND))
        for seen, places in ((camera.gel_x, touching[:, 0]), (camera.gel_z, touching[:, 2]))
    )
    if not (len(rows) and len(columns)):
        return heights
    near = np.ix_(rows, columns)
    points = _points(camera, heights[near], rows, columns)
    gap, gradient = pose.distance(indenter, points)
    lowest, inside = points[:, 1].copy(), gap < 0
    left = np.flatnonzero(inside)
    for _ in range(_ROUNDS):
        points[left, 1] -= gap[inside] / np.maximum(gradient[inside, 1], _LEAST_SLOPE)
        gap, gradient = pose.distance(indenter, points[left])
        inside = np.abs(gap) > MOVE_TOLERANCE
        left = left[inside]
        if not len(left):
            break
    found = heights.copy()
    found[near] += np.maximum(points[:, 1] - lowest, 0).reshape(len(rows), len(columns))
    return found


def reflectance_on(
    texture: np.ndarray, heights: np.ndarray, camera: Camera, indenter: Indenter, pose: Pose
) -> np.ndarray:
    """Return the reflectance (H, W) float32 of the body behind gel at heights (H, W) m.

    texture : (h, w), 0 black to 1 white, projected along the body's own z over its ``bounds``:
        columns along own x, rows against own y, so that the first row is at the greatest y; 0 beside the body"""
    own = pose.to_own(_points(camera, heights))
    lower, upper = indenter.bounds()
    share = ((own - lower) / (upper - lower)).astype(np.float32)  # 0 to 1 over the body
    behind = ((share[:, :2] >= 0) & (share[:, :2] <= 1)).all(axis=1)
    rows, columns = texture.shape
    at = lookup((1 - share[:, 1]) * rows - 0.5, share[:, 0] * columns - 0.5, texture.shape)
    return (at(texture) * behind).reshape(heights.shape)


def _points(
    camera: Camera, heights: np.ndarray, rows: np.ndarray | slice = _ALL, columns: np.ndarray | slice = _ALL
) -> np.ndarray:
    """Return places (h w, 3) m, sensor's frame, of gel at heights (h, w) m under these rows and columns of pixels."""
    x, z = np.meshgrid(camera.gel_x[rows], camera.gel_z[columns], indexing="ij")
    return np.stack([x, heights + camera.height_zero_y, z], axis=-1).reshape(-1, 3)
