"""Pictures of pressed balls by Mitsuba: our integrator with one bounce, on a scene that only changes its numbers."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...errors import TactileError
from ...sensors.calibration import Calibration
from ..mitsuba.gel_light import GelLight
from ..presets import Preset
from .ball_pictures import BallPictures


class MitsubaPictures:
    """Render units one after the other by one scene, which LLVM compiles once."""

    def __init__(self, preset: Preset) -> None:
        self.preset = preset
        self._light: GelLight | None = None

    def __call__(self, calibration: Calibration) -> BallPictures:
        """The pictures of a unit; LEDs must shine and the coating scatter."""
        return _OfUnit(calibration, self)

    def radiance(self, unit: Calibration, heights: np.ndarray) -> np.ndarray:
        """Return the radiance (H, W, 3), levels, of heights (H, W) m of a unit's gel."""
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

    def lights(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Change (3, H, W) by a press of each LED's light."""
        heights = self.heights(ball)
        change = (self._maker.radiance(self.calibration, heights) - self._resting) / self._facing
        return self.spread(np.moveaxis(change, -1, 0) + self.raised(self._view(heights) - self._view(self.rest)))


def working_preset(preset: Preset, factor: int) -> Preset:
    """Return a preset for pictures smaller by a factor: the bounce on as many places of the gel, or half as many."""
    return dataclasses.replace(preset, bounce_step=max(preset.bounce_step // factor, 4) if preset.bounce_step else 0)
