"""Fast picture of the gel: three coloured LEDs on a white, matte coating, with soft cast shadows; numpy alone.

Radiance is Lambert's cosine times the inverse square of distance. What light the gel throws on itself, the coating's
gloss and the window are left out.
"""

from __future__ import annotations

import numpy as np

from ..errors import TactileError
from ..files.compiled import Loop, available
from ..sensors.calibration import LARGEST_LEVEL, Calibration
from ..sensors.calibration_file import load_calibration
from ..sensors.camera import COLOURS
from .background import raised_light, resting_picture
from .coating_spread import CoatingSpread
from .height_map import of_unit, rest_height_map
from .lamp_light import Lamps
from .perspective import Perspective


class Shader:
    """Pictures of height maps; what only the resting gel decides is computed once.

    calibration : None for the one that ships
    background : (H, W, 3) picture of the undeformed gel, 8-bit values; None for what the calibration makes
    rest : (H, W) heights of the undeformed gel, m, that height maps rise from; None for the DIGIT's
    Raises TactileError for arrays of another shape, values that are not finite, LEDs over the picture, or a gel that
    reaches an LED or the camera.
    """

    def __init__(
        self,
        calibration: Calibration | None = None,
        background: np.ndarray | None = None,
        rest: np.ndarray | None = None,
    ) -> None:
        self.calibration = calibration = calibration or load_calibration()
        camera = self.camera = calibration.camera
        self._dome = rest is None  # heights have the public mesh's dome, which the unit's own takes the place of
        self._resting = rest_height_map(camera) if rest is None else camera_array(rest, camera.shape, "rest height map")
        rest = of_unit(self._resting, calibration) if self._dome else self._resting
        self.view = Perspective(camera, rest)
        check_reach(rest, calibration, "rest height map")
        self.rest = self.view(rest)
        self.spread = CoatingSpread(camera, calibration.coating.spread)
        self.lamps = Lamps(camera, calibration.leds)
        self.rest_radiance = self._seen_radiance(self.rest)
        if background is None:
            background = resting_picture(calibration, np.moveaxis(self.rest_radiance, 0, -1))
        self.background = camera_array(background, (*camera.shape, 3), "background")
        self._levels = np.ascontiguousarray(np.moveaxis(self.background, -1, 0))
        self.response = np.ascontiguousarray(calibration.pixel_response.transpose(2, 3, 0, 1), np.float32)
        self._rest_picture = self._drawn(self.rest_radiance)

    def __call__(self, height_map: np.ndarray) -> np.ndarray:
        """Picture (H, W, 3) uint8 of heights (H, W) m; bit-equal to the background's where nothing changed."""
        if np.array_equal(height_map, self._resting):
            return self._rest_picture.copy()
        return self._drawn(self._radiance(height_map))

    def _drawn(self, radiance: np.ndarray) -> np.ndarray:
        """Picture (H, W, 3) uint8 of the radiance (3, H, W) of the LEDs."""
        if available():
            return in_picture(radiance, self.rest_radiance, self.response, self.background, np.float32(LARGEST_LEVEL))
        change = radiance - self.rest_radiance
        picture = np.empty((*self.camera.shape, 3), np.uint8)
        for channel in range(len(COLOURS)):
            level = self._levels[channel].copy()
            for response, light in zip(self.response[channel], change, strict=True):
                level += response * light
            np.rint(level, out=level)
            picture[..., channel] = np.clip(level, 0, LARGEST_LEVEL, out=level)
        return picture

    def radiance(self, height_map: np.ndarray) -> np.ndarray:
        """Return the radiance (H, W, 3) float32, levels, of each pixel's coating, by LED; height_map : (H, W) m."""
        return np.moveaxis(self._radiance(height_map), 0, -1)

    def _radiance(self, height_map: np.ndarray) -> np.ndarray:
        heights = camera_array(height_map, self.camera.shape, "height map")
        heights = of_unit(heights, self.calibration) if self._dome else heights
        check_reach(heights, self.calibration, "height map")
        return self._seen_radiance(self.view(heights))

    def _seen_radiance(self, seen: np.ndarray) -> np.ndarray:
        """Radiance (3, H, W) of heights (H, W) that the pixels see."""
        light = self.lamps.light(self.view, seen)
        light *= self.calibration.facing.astype(np.float32)[:, None, None]
        light += raised_light(self.calibration, seen)
        return self.spread(light)


def camera_array(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Convert values to float32; raises TactileError, by their name, for another shape or what is not finite."""
    values = np.asarray(values)
    if values.shape != shape:
        raise TactileError(name, f"shape {values.shape}", f"{shape}, as the camera's picture")
    if not np.isfinite(values).all():
        raise TactileError(name, "values that are not finite", "finite numbers", "Repair the frame first")
    return values.astype(np.float32)


def check_reach(height: np.ndarray, unit: Calibration, name: str) -> None:
    """Raise TactileError for heights (H, W) m that reach an LED's middle or the camera, or as far the other way."""
    lowest = min(unit.leds, key=lambda led: led.position[2])
    limits = {f"the {lowest.colour} LED": lowest.position[2], "the camera": unit.camera.apparent_height}
    for what, limit in limits.items():
        if float(height.max()) >= limit:
            found = f"{height.max() * 1e3:.2f} mm high, {what} {limit * 1e3:.2f} mm"
            raise TactileError(name, found, "a gel below LEDs and camera", "Check that heights are in metres")
    if float(height.min()) <= -unit.camera.apparent_height:
        found, expected = f"{height.min() * 1e3:.2f} mm high", f"above {-1e3 * unit.camera.apparent_height:.2f} mm"
        raise TactileError(name, found, expected, "Check that heights are in metres")


def in_picture(
    radiance: np.ndarray, rest: np.ndarray, response: np.ndarray, background: np.ndarray, largest: np.float32
) -> np.ndarray:
    """Compute (H, W, 3) uint8: background (H, W, 3) + response (3, 3, H, W) times radiance less that at rest (3, H, W).

    All float32; largest : level
    """
    picture = np.empty(background.shape, np.uint8)
    rows = len(picture), -1
    _fill_levels(radiance, rest, response, background.reshape(rows), largest, picture.reshape(rows))
    return picture


@Loop
def _fill_levels(radiance, rest, response, background, largest, picture):  # noqa: ANN001, ANN202
    """Fill in the picture of ``in_picture``; background, picture : (H, 3 W)."""
    _, height, width = radiance.shape
    lowest, change, line = np.float32(0), np.empty((3, width), np.float32), np.empty(3 * width, np.float32)
    for row in range(height):  # a row stays in the processor's cache
        for led in range(3):
            for column in range(width):
                change[led, column] = radiance[led, row, column] - rest[led, row, column]
        for channel in range(3):
            for column in range(width):
                level = np.float32(0)
                for led in range(3):
                    level += response[channel, led, row, column] * change[led, column]
                line[3 * column + channel] = level
        for k in range(3 * width):
            value = np.rint(line[k] + background[row, k])
            picture[row, k] = np.uint8(np.int32(min(max(value, lowest), largest)))  # by way of 32 bits: vectorised
