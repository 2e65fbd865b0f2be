"""Soft shadows that a height field casts in the light of one small LED: a march toward the light in polar rows."""

from __future__ import annotations

import functools

import numpy as np

from .camera import Camera, Led
from .errors import TactileError

GRID_STEP = 0.1e-3  # m, of the polar grid along a ray, and across rays in the picture's middle
MIN_RISE = 10e-6  # m; what has risen less throws a shadow of a pixel at most, lights at 20 degrees or higher
FREE = 1.0  # sight from which on the whole LED is seen

_TABLE_STEPS = 256


class ShadowCaster:
    """How much of one LED each pixel sees over the height field.

    The field is sampled on rays that leave the LED's foot point, (angle, distance), where a march toward the light
    is a shift along rows. Gel outside the picture is taken as flat, as high as the picture's edge.
    Raises TactileError for an LED whose foot point lies in the picture.
    """

    def __init__(self, camera: Camera, led: Led) -> None:
        self.led = led
        right, down = np.meshgrid(camera.right, camera.down)
        if abs(led.position[0]) <= right.max() and abs(led.position[1]) <= down.max():
            found = f"({led.position[0] * 1e3:.1f}, {led.position[1] * 1e3:.1f}) mm, inside the picture"
            raise TactileError(f"led {led.colour}, position", found, "a place beside it, as round the gel's window")
        right, down = right - led.position[0], down - led.position[1]
        middle = np.arctan2(-led.position[1], -led.position[0])  # angle from the foot to the picture's centre
        # Turned so that the picture lies around angle 0: no jump at +-pi inside it.
        angle = np.angle((right + 1j * down) * np.exp(-1j * middle))
        distance = np.hypot(right, down)
        self._step_angle = GRID_STEP / float(np.hypot(*led.position[:2]))
        self._angle_0, self._distance_0 = angle.min(), distance.min()
        self._row = ((angle - self._angle_0) / self._step_angle).astype(np.float32)
        self._column = ((distance - self._distance_0) / GRID_STEP).astype(np.float32)
        rows, columns = int(np.ceil(self._row.max())) + 1, int(np.ceil(self._column.max())) + 1
        ray = middle + self._angle_0 + self._step_angle * np.arange(rows)
        self.distance = (self._distance_0 + GRID_STEP * np.arange(columns)).astype(np.float32)
        across = led.position[0] + self.distance * np.cos(ray)[:, None]
        along = led.position[1] + self.distance * np.sin(ray)[:, None]
        step_right, step_down = camera.pixel_size
        self._pixel_column = ((across - camera.right[0]) / step_right).astype(np.float32)
        self._pixel_row = ((along - camera.down[0]) / step_down).astype(np.float32)
        self._shape = camera.shape

    def sight(self, height: np.ndarray, box: tuple[slice, slice]) -> tuple[np.ndarray, tuple[slice, slice]]:
        """How far the LED's centre stands above the horizon, in LED radii, cut to -1 (hidden) .. 1 (all seen).

        height : (H, W) float32, m; box : rows and columns of pixels that may throw shadows
        Returns sight (h, w) and the box of pixels it is for; it is 1 everywhere else.
        """
        reach = self._reach(float(height[box].max()), float(height.min()))
        rows = _span(self._row[box], self._row)
        columns = _span(self._column[box], self._column, reach)
        polar = (rows, columns)
        field = bilinear(height, self._pixel_row[polar], self._pixel_column[polar])
        sight = self._march(field, self.distance[columns], reach)
        shadow = bounding_box(sight < FREE, margin=1)
        if shadow is None:
            return sight[:0, :0], (slice(0, 0), slice(0, 0))
        sight = sight[shadow]
        first_row, first_column = rows.start + shadow[0].start, columns.start + shadow[1].start
        polar = slice(first_row, first_row + sight.shape[0]), slice(first_column, first_column + sight.shape[1])
        height_range, width_range = (np.array([0, size - 1]) for size in self._shape)
        pixels = _span(self._pixel_row[polar], height_range), _span(self._pixel_column[polar], width_range)
        return bilinear(sight, self._row[pixels] - first_row, self._column[pixels] - first_column), pixels

    def _reach(self, highest: float, lowest: float) -> int:
        """Columns that the longest shadow of such heights covers."""
        rise = self.led.position[2] - self.led.radius - highest
        slope = max(rise, self.led.radius) / self.distance[-1]
        return int(np.ceil((highest - lowest) / slope / GRID_STEP)) + 1

    def _march(self, field: np.ndarray, distance: np.ndarray, reach: int) -> np.ndarray:
        above = self.led.position[2] - field
        horizon = np.full_like(field, -np.inf)
        for k in march_steps(min(reach, field.shape[1] - 1)):
            rise = field[:, :-k] - field[:, k:]
            rise *= np.float32(1 / (k * GRID_STEP))
            np.maximum(horizon[:, k:], rise, out=horizon[:, k:])
        # (tangent of the LED's centre - tangent of the horizon) as an angle over the LED's angular radius.
        far = np.sqrt(distance**2 + above**2)
        sight = (above / distance - horizon) * (distance**2 / (far * np.float32(self.led.radius)))
        return np.clip(sight, -1, FREE)


def march_steps(reach: int) -> list[int]:
    """Steps of a march: each one at first, then every tenth of the way; what throws a shadow far is wide."""
    steps, k = [], 1
    while k <= reach:
        steps.append(k)
        k += max(1, k // 10)
    return steps


def bounding_box(mask: np.ndarray, margin: int = 0) -> tuple[slice, slice] | None:
    """Rows and columns that enclose what is true in mask (h, w), margin further within the mask; None for nothing."""
    box = []
    for axis in (1, 0):
        found = np.flatnonzero(mask.any(axis))
        if not len(found):
            return None
        box.append(slice(max(int(found[0]) - margin, 0), min(int(found[-1]) + 1 + margin, mask.shape[1 - axis])))
    return box[0], box[1]


def _span(wanted: np.ndarray, limits: np.ndarray, more: int = 0) -> slice:
    """Two whole numbers or more that enclose the values wanted, `more` further up, within the limits' own range."""
    lowest, highest = int(np.floor(limits.min())), int(np.ceil(limits.max()))
    first = min(max(int(np.floor(wanted.min())), lowest), highest - 1)
    last = min(int(np.ceil(wanted.max())) + more, highest)
    return slice(first, max(last, first + 1) + 1)


def bilinear(values: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """values (h, w), 2 x 2 or more, at fractional places, the edge held beyond the ends; float32."""
    height, width = values.shape
    row, column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
    i, j = np.minimum(row.astype(np.intp), height - 2), np.minimum(column.astype(np.intp), width - 2)
    t, s = row - i.astype(np.float32), column - j.astype(np.float32)
    start, flat = i * width + j, np.ravel(values)
    upper = flat.take(start)
    upper += s * (flat.take(start + 1) - upper)
    lower = flat.take(start + width)
    lower += s * (flat.take(start + width + 1) - lower)
    return upper + t * (lower - upper)


@functools.cache
def _disc_tables() -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(-1, 1, _TABLE_STEPS + 1)
    share = 0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi
    moment = 2 / (3 * np.pi) * (1 - t**2) ** 1.5
    return share.astype(np.float32), moment.astype(np.float32)


def disc_share(sight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of a disc of radius 1 cut by a horizon `sight` below its centre: area seen and its first moment upward.

    Both over the whole disc's area (circular segment): share 1/2 + (t sqrt(1 - t^2) + asin t) / pi,
    moment 2 (1 - t^2)^(3/2) / (3 pi).
    """
    share, moment = _disc_tables()
    place = ((sight + 1) * (_TABLE_STEPS / 2)).astype(np.intp)
    return share.take(place), moment.take(place)
