"""Lambert's law where pixels see the gel: the radiance that each LED gives to each pixel; numpy alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ..sensors.calibration import Calibration
from ..sensors.camera import Camera
from .cast_shadows import bounding_box
from .perspective import bilinear


@dataclasses.dataclass(frozen=True)
class Hits:
    """Gel that pixels see, arrays of the picture's shape.

    right, down, height : m, image frame; slope_right, slope_down : of the gel there
    level : the unit normal's component toward the camera
    """

    right: np.ndarray
    down: np.ndarray
    height: np.ndarray
    slope_right: np.ndarray
    slope_down: np.ndarray
    level: np.ndarray

    @classmethod
    def from_slopes(cls, place: np.ndarray, slope_right: np.ndarray, slope_down: np.ndarray) -> Hits:
        """Make hits; place : (..., 3) m, image frame; slopes : (...) there."""
        right, down, height = np.ascontiguousarray(np.moveaxis(place, -1, 0))
        level = 1 / np.sqrt(1 + slope_right**2 + slope_down**2)
        return cls(right, down, height, slope_right, slope_down, level)

    @classmethod
    def on_map(cls, place: np.ndarray, slopes: tuple[np.ndarray, np.ndarray], camera: Camera) -> Hits:
        """Make hits on a height map; place : (H, W, 3) m, image frame; slopes : (H, W), by ``perspective.slopes``."""
        look_up = map_lookup(place[..., 0], place[..., 1], camera)
        return cls.from_slopes(place, look_up(slopes[0]), look_up(slopes[1]))


def map_lookup(right: np.ndarray, down: np.ndarray, camera: Camera) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that looks up maps (H, W) of the gel at places on it, m, image frame."""
    step_right, step_down = camera.pixel_size
    row = down * np.float32(1 / step_down) + np.float32(camera.height / 2 - 0.5)
    return lookup(row, right * np.float32(1 / step_right) + np.float32(camera.width / 2 - 0.5), camera.shape)


def lookup(row: np.ndarray, column: np.ndarray, shape: tuple[int, int]) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that looks up maps of a shape at fractional places, bilinear; beyond an edge, the edge."""
    row, column = np.clip(row, 0, shape[0] - 1), np.clip(column, 0, shape[1] - 1)
    return lambda values: bilinear(values, row, column)


def direct_light(
    hits: Hits, seen: np.ndarray | None, points: Sequence[np.ndarray], unit: Calibration, soften: bool = False
) -> np.ndarray:
    """Return the radiance (H, W, 3) float32, levels, of the three LEDs on a matte coating.

    seen : (H, W) uint32, a bit a point; None where all of them are
    points : (n, 3) m of each LED, n <= 8, in the order of the bits
    soften : even out the steps that few points leave in a shadow's edge, over 3 x 3 pixels
    """
    radiance = np.zeros((*hits.level.shape, 3), np.float32)
    bit = 0
    for led, facing_level, cloud in zip(unit.leds, unit.facing, points, strict=True):
        x, y, z = np.asarray(led.position, np.float32)
        right, down, above = x - hits.right, y - hits.down, z - hits.height
        square = right * right + down * down + above * above
        facing = above - hits.slope_right * right - hits.slope_down * down
        if seen is not None:
            part = (seen >> np.uint32(bit)) & np.uint32(2 ** len(cloud) - 1)
            _dim(facing, hits, part, cloud, soften)
        np.maximum(facing, 0, out=facing)
        # Inverse square, and the length of the vector in the cosine.
        facing *= hits.level / (square * np.sqrt(square)) * np.float32(np.square(led.position).sum() * facing_level)
        radiance[..., led.channel] += facing
        bit += len(cloud)
    return radiance


def _dim(facing: np.ndarray, hits: Hits, seen: np.ndarray, cloud: np.ndarray, soften: bool) -> None:
    """Cosine times distance of a light's middle becomes, in place, the mean over its points of those that are seen.

    They are so close together that they differ in direction alone: n . (l + d), d from the middle to the point.
    """
    every = 2 ** len(cloud) - 1
    box = bounding_box(seen != every, margin=1)
    if box is None:
        return
    codes = (np.arange(every + 1)[:, None] >> np.arange(len(cloud))) & 1
    offsets = codes @ (cloud - cloud.mean(0)) / len(cloud)
    tables = np.column_stack([codes.mean(1), offsets]).astype(np.float32).T
    share, right, down, above = (table.take(seen[box]) for table in tables)
    if soften:
        share, right, down, above = (evened(values) for values in (share, right, down, above))
    facing[box] *= share
    facing[box] += above - hits.slope_right[box] * right - hits.slope_down[box] * down


def evened(values: np.ndarray) -> np.ndarray:
    """Return the means of values (h, w) over 3 x 3 pixels; at the border the edge counts twice."""
    for axis in (0, 1):
        total = np.moveaxis(values.copy(), axis, 0)
        along = np.moveaxis(values, axis, 0)
        total[1:] += along[:-1]
        total[:-1] += along[1:]
        total[0] += along[0]
        total[-1] += along[-1]
        values = np.moveaxis(total, 0, axis) * np.float32(1 / 3)
    return values
