"""Compute the soft shadows that the gel casts in the light of one small LED, by marching toward it on a polar grid.

The projective map (right, down, h) -> (right, down, h) / (1 - h / apparent height) takes lines to lines and the pinhole
to infinity. Mapped, the gel that pixels see is a height field over the pixels (the mapped field below), and its shadows
in the light of the mapped LED are those that the picture shows."""

from __future__ import annotations

import functools

import numpy as np

from ..errors import TactileError
from ..files.compiled import Loop, available
from ..sensors.camera import Camera, Led
from .perspective import bilinear

GRID_STEP = 0.1e-3  # m, of the polar grid along a ray, and across rays in the picture's middle
FREE = 1.0  # sight (see ``ShadowCaster.sight``) from which the whole LED is visible
HIGHEST = 0.9  # share of the camera's height that an LED may have: at 1 the map takes it to infinity
SMALLEST_SLOPE = 0.02  # of the light; shadows of flatter light are cut at 50 times their height, beyond the picture

_TABLE_STEPS = 256


class ShadowCaster:
    """Finds the share of one LED that is visible from the gel at each pixel.

    The mapped field is sampled on rays from the LED's foot point (right, down of the mapped LED), (angle, distance),
    where a march toward the light is a shift along rows. Gel outside the picture is assumed flat, as high as its edge.
    Raises TactileError for an LED whose foot point lies in the picture, or that is as high as the camera."""

    def __init__(self, camera: Camera, led: Led) -> None:
        self.led = led
        if led.position[2] + led.radius > HIGHEST * camera.apparent_height:
            found = f"{(led.position[2] + led.radius) * 1e3:.1f} mm high"
            expected = f"well below the camera, {camera.apparent_height * 1e3:.1f} mm"
            raise TactileError(f"led {led.colour}, position", found, expected)
        # The LED under the map, ``foot``; then the polar grid about it, where pixels lie in it, and it in pixels.
        near = 1 - led.position[2] / camera.apparent_height
        foot = self.foot = tuple(value / near for value in led.position)
        right, down = np.meshgrid(camera.right, camera.down)
        if abs(foot[0]) <= right.max() and abs(foot[1]) <= down.max():
            found = f"({led.position[0] * 1e3:.1f}, {led.position[1] * 1e3:.1f}) mm, inside the picture"
            raise TactileError(f"led {led.colour}, position", found, "a place beside it, as round the gel's window")
        right, down = right - foot[0], down - foot[1]
        middle = np.arctan2(-foot[1], -foot[0])  # angle from the foot to the picture's centre
        # Turned so that the picture lies around angle 0: no jump at +-pi inside it.
        angle = np.angle((right + 1j * down) * np.exp(-1j * middle))
        distance = np.hypot(right, down)
        self._step_angle = GRID_STEP / float(np.hypot(foot[0], foot[1]))
        self._angle_0, self._distance_0 = angle.min(), distance.min()
        self.row = ((angle - self._angle_0) / self._step_angle).astype(np.float32)
        self.column = ((distance - self._distance_0) / GRID_STEP).astype(np.float32)
        rows, columns = int(np.ceil(self.row.max())) + 1, int(np.ceil(self.column.max())) + 1
        ray = (middle + self._angle_0 + self._step_angle * np.arange(rows))[:, None]
        self.distance = (self._distance_0 + GRID_STEP * np.arange(columns)).astype(np.float32)
        across, along = foot[0] + self.distance * np.cos(ray), foot[1] + self.distance * np.sin(ray)
        step_right, step_down = camera.pixel_size
        last_row, last_column = camera.height - 1, camera.width - 1
        self.pixel_column = ((across - camera.right[0]) / step_right).clip(0, last_column).astype(np.float32)
        self.pixel_row = ((along - camera.down[0]) / step_down).clip(0, last_row).astype(np.float32)
        self.radii = self._radii_of_slope(camera, across, along).astype(np.float32)
        self._shape, self.polar_shape = camera.shape, (rows, columns)

    def _radii_of_slope(self, camera: Camera, across: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return by how many LED radii a mapped line of sight rises at the LED per unit of its slope, (rows, columns).
        across, along : (rows, columns) m, right and down of the polar grid's places

        A rise dw of the mapped line at the LED is a displacement (1 - h / H)^2 (-right / H, -down / H, 1) dw in space,
        where right, down are the mapped LED's, h is the LED's height and H the apparent height. Only its component
        across the line counts. The line is taken to start at height zero, which changes its angle by a few degrees."""
        led, inverse = np.asarray(self.led.position), 1 / camera.apparent_height
        rise = (1 - led[2] * inverse) ** 2 * np.array([-self.foot[0] * inverse, -self.foot[1] * inverse, 1.0])
        to_led = np.stack([led[0] - across, led[1] - along, np.full_like(across, led[2])], -1)
        part = (to_led @ rise) ** 2 / (to_led**2).sum(-1)
        return self.distance * np.sqrt(rise @ rise - part) / self.led.radius

    def sight(self, height: np.ndarray, box: tuple[slice, slice]) -> tuple[np.ndarray, tuple[slice, slice]]:
        """Return the sight (h, w), and the box of pixels that it is for; from all others the whole LED is visible.
        Sight is the height of the LED's centre over the horizon in LED radii, from -1 (hidden) to 1 (visible).
        height : (H, W) float32, m, the mapped field; box : rows and columns of pixels that may cast shadows"""
        reach = self.reach(float(height[box].max()), float(height.min()))
        rows = _span(self.row[box], self.polar_shape[0] - 1)
        columns = _span(self.column[box], self.polar_shape[1] - 1, reach)
        polar = (rows, columns)
        field = bilinear(height, self.pixel_row[polar], self.pixel_column[polar])
        sight = self._march(field, polar, reach)
        shadow = bounding_box(sight < FREE, margin=1)
        if shadow is None:
            return sight[:0, :0], (slice(0, 0), slice(0, 0))
        sight = sight[shadow]
        first_row, first_column = rows.start + shadow[0].start, columns.start + shadow[1].start
        polar = slice(first_row, first_row + sight.shape[0]), slice(first_column, first_column + sight.shape[1])
        pixels = (_span(self.pixel_row[polar], self._shape[0] - 1), _span(self.pixel_column[polar], self._shape[1] - 1))
        row = np.clip(self.row[pixels] - np.float32(first_row), 0, sight.shape[0] - 1)
        column = np.clip(self.column[pixels] - np.float32(first_column), 0, sight.shape[1] - 1)
        return bilinear(sight, row, column), pixels

    def reach(self, highest: float, lowest: float) -> int:
        """Return the polar columns that the longest shadow covers; highest, lowest : m, largest and least mapped
        height"""
        rise = self.foot[2] - highest
        slope = max(rise / float(self.distance[-1]) - 1 / float(self.radii[:, -1].min()), SMALLEST_SLOPE)
        return int(np.ceil((highest - lowest) / slope / GRID_STEP)) + 1

    def _march(self, field: np.ndarray, polar: tuple[slice, slice], reach: int) -> np.ndarray:
        """Return the sight (rows, columns), -1 to FREE: at distance r from the LED's foot point ((height - h(r)) / r -
        horizon) radii, height that of the mapped LED, horizon the largest (h(r - d) - h(r)) / d over steps d.
        field : (rows, columns) m, h in the part ``polar`` of the polar grid; reach : columns of the longest shadow"""
        if available():
            steps = np.array(march_steps(min(reach, field.shape[1] - 1)), np.int64)
            foot = np.float32(self.foot[2])
            return march(field, foot, self.distance[polar[1]], self.radii[polar], steps, GRID_STEP)
        horizon = np.full_like(field, -np.inf)
        for k in march_steps(min(reach, field.shape[1] - 1)):
            rise = field[:, :-k] - field[:, k:]
            rise *= np.float32(1 / (k * GRID_STEP))
            np.maximum(horizon[:, k:], rise, out=horizon[:, k:])
        sight = np.float32(self.foot[2]) - field
        sight /= self.distance[polar[1]]
        sight -= horizon
        sight *= self.radii[polar]
        return np.clip(sight, -1, FREE, out=sight)


@functools.cache
def march_steps(reach: int) -> tuple[int, ...]:
    """Return the distances, in columns up to ``reach``, at which a march looks for the horizon: 1 apart at first, then
    a tenth of the distance apart (long shadows are wide)."""
    steps, k = [], 1
    while k <= reach:
        steps.append(k)
        k += max(1, k // 10)
    return tuple(steps)


def bounding_box(mask: np.ndarray, margin: int = 0) -> tuple[slice, slice] | None:
    """Return slices of rows and columns that enclose the true pixels of ``mask`` (h, w), cut at its edges; None if no
    pixel is true. margin : px, added on each side"""
    box = []
    for axis in (1, 0):
        found = np.flatnonzero(mask.any(axis))
        if not len(found):
            return None
        box.append(slice(max(int(found[0]) - margin, 0), min(int(found[-1]) + 1 + margin, mask.shape[1 - axis])))
    return box[0], box[1]


def _span(wanted: np.ndarray, highest: int, more: int = 0) -> slice:
    """Return the slice from the least of ``wanted`` (...) to the largest plus ``more``, rounded outward, within the
    integers 0 to ``highest``; it holds 2 or more."""
    first = min(max(int(np.floor(wanted.min())), 0), highest - 1)
    last = min(int(np.ceil(wanted.max())) + more, highest)
    return slice(first, max(last, first + 1) + 1)


@functools.cache
def disc_tables() -> tuple[np.ndarray, np.ndarray]:
    """Return the areas and moments of ``disc_share``, (257,) float32 each, at even steps of sight from -1 to 1."""
    t = np.linspace(-1, 1, _TABLE_STEPS + 1)
    share = 0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi
    moment = 2 / (3 * np.pi) * (1 - t**2) ** 1.5
    return share.astype(np.float32), moment.astype(np.float32)


def disc_share(sight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the visible area (...), and its upward moment (...), of a unit disc cut by a horizon `sight` t (...) below
    its centre, both divided by the disc's area (circular segment): 1/2 + (t sqrt(1 - t^2) + asin t) / pi, and
    2 (1 - t^2)^(3/2) / (3 pi)."""
    share, moment = disc_tables()
    place = ((sight + 1) * (_TABLE_STEPS / 2)).astype(np.intp)
    return share.take(place), moment.take(place)


@Loop
def march(field, foot, distance, radii, steps, grid_step):  # noqa: ANN001, ANN201
    """March toward an LED of mapped height ``foot``, m, over field (rows, columns) m, mapped heights; return the sight,
    -1 hidden to 1 visible, (rows, columns): ((foot - field) / distance - slope of the horizon) radii.
    distance : (columns,) m from the LED's foot point; radii : (rows, columns), LED radii per unit of slope
    steps : (k,) columns, each of grid_step m, at which the horizon is looked for toward the LED"""
    rows, columns = field.shape
    sight = np.empty((rows, columns), np.float32)
    horizon = np.empty(columns, np.float32)
    for row in range(rows):
        horizon[:] = -np.inf
        for step in steps:
            scale = np.float32(1 / (step * grid_step))
            before, here, highest = field[row, : columns - step], field[row, step:], horizon[step:]
            for column in range(columns - step):  # of slices alone, which is vectorised
                highest[column] = max(highest[column], (before[column] - here[column]) * scale)
        for column in range(columns):
            seen = ((foot - field[row, column]) / distance[column] - horizon[column]) * radii[row, column]
            sight[row, column] = min(max(seen, np.float32(-1)), np.float32(1))
    return sight
