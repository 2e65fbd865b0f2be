"""What a DIGIT unit's pictures depend on: camera, lights, colours, gel and background, as one frozen set of numbers.

A picture is ``background + C(right, down) (L_contact - L_flat)`` in raw 8-bit values, where L is the radiance of the
three LEDs on the coating. Radiance is counted in units of what an LED gives on a coating that faces it at the distance
from the LED to the picture's centre at height zero. The fast picture (``shading``) and Mitsuba's share it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from ..errors import TactileError
from .camera import COLOURS, Camera, Led

BACKGROUND_DEGREE = 5
BACKGROUND_TERMS = (BACKGROUND_DEGREE + 1) * (BACKGROUND_DEGREE + 2) // 2
BACKGROUND_UNIT = 10e-3  # m; image coordinates are divided by it in a background's polynomial
LARGEST_LEVEL = 255.0


@dataclasses.dataclass(frozen=True)
class Gain:
    """The matrix C (channel, led) of grey levels a unit of radiance, linear over the picture.

    centre : (3, 3) grey levels in the picture's middle, a row a channel of the picture, a column an LED's colour
    along_right, along_down : (3, 3) grey levels a metre of the plane of height zero
    """

    centre: tuple[tuple[float, ...], ...]
    along_right: tuple[tuple[float, ...], ...]
    along_down: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            matrix = np.asarray(getattr(self, field.name), float)
            if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
                raise TactileError(f"gain, {field.name}", f"shape {matrix.shape}", "3 rows of 3 finite numbers")
        for channel, colour in enumerate(COLOURS):
            if not self.centre[channel][channel] > 0:
                found = f"{self.centre[channel][channel]:g} levels of {colour} by the {colour} LED"
                raise TactileError("gain, centre", found, "more than 0: light brightens its own colour")

    def matrices(self, camera: Camera) -> np.ndarray:
        """C (H, W, 3, 3) of each pixel."""
        centre, right, down = (np.asarray(matrix) for matrix in (self.centre, self.along_right, self.along_down))
        return centre + camera.right[None, :, None, None] * right + camera.down[:, None, None, None] * down


@dataclasses.dataclass(frozen=True)
class Background:
    """The picture of the untouched gel: a smooth polynomial, or the user's own photograph.

    polynomial : (3, 21) grey levels, a row a channel: of right^i down^j / (10 mm)^(i + j), ordered by i + j, then by j
    photograph : path of the photograph that takes the polynomial's place; "" for none
    """

    polynomial: tuple[tuple[float, ...], ...]
    photograph: str = ""

    def __post_init__(self) -> None:
        table = np.asarray(self.polynomial, float)
        if table.shape != (3, BACKGROUND_TERMS) or not np.isfinite(table).all():
            expected = f"3 rows of {BACKGROUND_TERMS} finite numbers"
            raise TactileError("background, polynomial", f"shape {table.shape}", expected)


@dataclasses.dataclass(frozen=True)
class Fit:
    """What a calibration was fitted on, and how well.

    photographs : names of the files; the folder is the user's
    ball_diameter : m
    errors : on those photographs, by the names of ``tactile calibrate --test``
    standard_errors : by parameter, in its unit in the file
    not_identified : parameters that the photographs tell too little of; held near the start's by how units differ
    """

    note: str
    photographs: tuple[str, ...]
    ball_diameter: float
    errors: Mapping[str, float]
    standard_errors: Mapping[str, float]
    not_identified: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Calibration:
    """One unit. Raises TactileError for a number out of its range.

    unit : its name, free text
    leds : red, green, blue
    dome_scale : height of the resting gel over its lowest point, times that of the public mesh
    albedo : 0..1 share of light that the coating scatters back, for interreflection; 0 leaves it out
    noise : standard deviation of the camera's noise, grey levels, a channel; pictures have none unless asked for it
    """

    unit: str
    camera: Camera
    leds: tuple[Led, Led, Led]
    gain: Gain
    dome_scale: float
    albedo: float
    background: Background
    noise: tuple[float, float, float]
    fit: Fit

    def __post_init__(self) -> None:
        if tuple(led.colour for led in self.leds) != COLOURS:
            raise TactileError("leds", repr([led.colour for led in self.leds]), f"one each of {', '.join(COLOURS)}")
        _check_range("gel, dome_scale", self.dome_scale, 0.0, 5.0)
        _check_range("gel, albedo", self.albedo, 0.0, 1.0)
        if len(self.noise) != 3:
            raise TactileError("noise, levels", repr(self.noise), "three numbers")
        for level in self.noise:
            _check_range("noise, levels", level, 0.0, LARGEST_LEVEL)
        _check_range("fit, ball_diameter_mm", self.fit.ball_diameter, 0.0, 0.1)

    def at_size(self, width: int, height: int) -> Calibration:
        """The same view in other pixels: px/mm grow with the picture. Raises TactileError for another aspect ratio."""
        return dataclasses.replace(self, camera=self.camera.at_size(width, height))


def _check_range(where: str, value: float, least: float, most: float) -> None:
    if not (math.isfinite(value) and least <= value <= most):
        raise TactileError(where, f"{value:g}", f"{least:g} to {most:g}")
