"""Pictures of balls pressed into a unit, and their derivatives by single numbers."""

from __future__ import annotations

import abc
import dataclasses
import os
from collections.abc import Callable

import numpy as np

from ...errors import TactileError
from ...files import installed
from ...sensors.calibration import Calibration
from ...sensors.camera import Camera
from ...sensors.gel_shape import shape_of
from ..background import raised_light
from ..coating_spread import CoatingSpread
from ..height_map import check_covered
from ..light import Lamps, contact_share
from ..mitsuba.gel_light import GelLight
from ..mitsuba.variant import llvm_trouble
from ..perspective import Perspective
from ..presets import FAST, Preset, preset_named
from .ball_print import deepest, print_on

WORKING_WIDTH = 120  # px, least short side of the pictures for fits, which are reduced by whole factors


class BallPictures(abc.ABC):
    """Pictures of a ball pressed into the gel of one calibration; subclasses compute the light. Raises TactileError for
    a camera that sees past the gel."""

    def __init__(self, calibration: Calibration) -> None:
        check_covered(calibration.camera.surface, calibration.camera)
        self.calibration = calibration
        self.camera: Camera = calibration.camera
        x, z = np.meshgrid(self.camera.gel_x, self.camera.gel_z, indexing="ij")
        shape = shape_of(self.camera.sensor)
        self.thickness = shape.thickness
        dome = shape.back_y - shape.dome_height(x, z) - self.camera.height_zero_y
        self.rest = (calibration.dome_scale * dome).astype(np.float32)
        self.right, self.down = np.meshgrid(self.camera.right, self.camera.down)
        self.spread = CoatingSpread(self.camera, calibration.coating.spread)
        self.gain = np.moveaxis(calibration.gain.matrices(self.camera), (2, 3), (0, 1))
        self._view = Perspective(self.camera, self.rest)

    def lights(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Return the change (3, H, W) of each LED's light that a press makes, the ball's light through the coating
        included, over the LED's light on a coating that faces it. ball : right, down, depth, radius, m"""
        heights = self.heights(ball)
        seen = self._view(heights)
        light = self.spread(self._changed(heights, seen))
        return light + self.calibration.through * contact_share(seen - self._view.start)

    @abc.abstractmethod
    def _changed(self, heights: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Return the change (3, H, W) of each LED's light on heights (H, W) m, before it spreads in the coating.
        seen : (H, W) m, the heights that the pixels see"""

    def heights(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Return the heights (H, W) float32, m, of gel under a ball; ball : (right, down, depth, radius), m"""
        return print_on(self.rest, self.right, self.down, ball, self.thickness)

    def deepest(self, radius: float) -> float:
        """Return the depth, m, up to which the gel's shape under a ball of a radius, m, is tabulated."""
        return deepest(radius, self.thickness)

    def raised(self, seen: np.ndarray) -> np.ndarray:
        """Return ambient light (3, H, W) that grows with seen heights (H, W) m, over LED light on a coating that faces
        it."""
        return raised_light(self.calibration, seen) / self.calibration.facing.astype(np.float32)[:, None, None]

    def change(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Return the change (H, W, 3) of the picture by a press, grey levels. ball : right, down, depth, radius, m"""
        return np.einsum("clhw,lhw->hwc", self.gain, self.lights(ball), optimize=True)

    def white(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Return the grey levels (H, W, 3) that a ball's light through the coating would add if it were as bright as a
        coating that faces the LEDs. ball : right, down, depth, radius, m"""
        share = contact_share(self._view(self.heights(ball)) - self._view.start)
        return self.gain.sum(1).transpose(1, 2, 0) * share[..., None]


class FastPictures(BallPictures):
    """Draw the pictures of balls by the fast preset."""

    def __init__(self, calibration: Calibration) -> None:
        super().__init__(calibration)
        self._lamps = Lamps(self.camera, calibration.leds)
        self._resting = self._radiance(self._view.start)

    def _changed(self, heights: np.ndarray, seen: np.ndarray) -> np.ndarray:
        return self._radiance(seen) - self._resting

    def _radiance(self, seen: np.ndarray) -> np.ndarray:
        return self._lamps.light(self._view, seen) + self.raised(seen)


def working_factor(width: int, height: int) -> int:
    """Return the whole factor by which a fit reduces width x height px, to 120 px or more on either side; 1 if none."""
    return whole_factor(width, height, WORKING_WIDTH)


def whole_factor(width: int, height: int, side: int) -> int:
    """Return the largest divisor of width and height that leaves at least ``side`` px of the shorter one, else 1."""
    wanted = max(min(width, height) // side, 1)
    return next(factor for factor in range(wanted, 0, -1) if width % factor == 0 and height % factor == 0)


def smaller(values: np.ndarray, factor: int) -> np.ndarray:
    """Return the means of values (H, W, ...) over squares of factor x factor pixels."""
    height, width = values.shape[0] // factor, values.shape[1] // factor
    blocks = values.reshape(height, factor, width, factor, *values.shape[2:])
    return blocks.mean((1, 3), dtype=np.float32)


def pictures_of(preset: str) -> Callable[[Calibration], BallPictures]:
    """Return the function that makes a unit's ``BallPictures`` by the preset of this name. Raises TactileError for a
    preset of Mitsuba's if Mitsuba or LLVM is missing."""
    if preset == FAST:
        return FastPictures
    if trouble := missing_mitsuba():
        raise TactileError("--preset", f"{preset!r}, but {trouble}", "LLVM 18 or newer", "See `tactile doctor`")
    return MitsubaPictures(preset_named(preset))


def missing_mitsuba() -> str:
    """Return why Mitsuba cannot draw pictures by LLVM, as a fit needs (it or LLVM is missing), or "" if it can."""
    try:
        import mitsuba  # noqa: F401
    except ModuleNotFoundError:
        return f"Mitsuba is not installed; to install it: {installed.advice('render')}"
    return llvm_trouble(os.environ.get("DRJIT_LIBLLVM_PATH", ""))


class MitsubaPictures:
    """Function from a unit to its ``BallPictures`` by a preset of Mitsuba's; all units share a scene, compiled once."""

    def __init__(self, preset: Preset) -> None:
        self.preset = preset
        self._light: GelLight | None = None

    def __call__(self, calibration: Calibration) -> BallPictures:
        """Return the pictures of a unit; LEDs must shine and the coating scatter."""
        return _OfUnit(calibration, self)

    def radiance(self, unit: Calibration, heights: np.ndarray) -> np.ndarray:
        """Return the radiance (H, W, LED), levels, of a unit's gel at heights (H, W) m."""
        if self._light is None:
            self._light = GelLight(unit, self.preset, heights, 0)
        elif self._light.unit is not unit:
            try:
                self._light.change_unit(unit)
            except TactileError:  # of another kind, as with a LED that has become a point
                self._light = GelLight(unit, self.preset, heights, 0)
        return self._light.radiance(heights)


class _OfUnit(BallPictures):
    def __init__(self, calibration: Calibration, maker: MitsubaPictures) -> None:
        super().__init__(calibration)
        self._maker, self._facing = maker, calibration.facing.astype(np.float32)
        self._resting = self._maker.radiance(calibration, self.rest)

    def _changed(self, heights: np.ndarray, seen: np.ndarray) -> np.ndarray:
        change = (self._maker.radiance(self.calibration, heights) - self._resting) / self._facing
        return np.moveaxis(change, -1, 0) + self.raised(seen - self._view.start)


def working_preset(preset: Preset, factor: int) -> Preset:
    """Return a preset for pictures reduced by ``factor``: its bounce is gathered at the same places, or 4 px apart."""
    return dataclasses.replace(preset, bounce_step=max(preset.bounce_step // factor, 4) if preset.bounce_step else 0)
