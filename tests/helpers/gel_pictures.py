"""What tests of pictures share: presses by formula, changed units, and the variants of Mitsuba that work here."""

import dataclasses

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.mitsuba.variant import choose_variant

NO_MITSUBA = 'Mitsuba is missing: pip install "tactile-core[render]"'


def works(variant: str) -> str:
    """The variant, or a skip that says why it does not work here."""
    pytest.importorskip("mitsuba", reason=NO_MITSUBA)
    try:
        return choose_variant(variant).name
    except TactileError as trouble:
        pytest.skip(str(trouble))


class Press:
    """A smoothed ball's print, m; added to the resting gel."""

    def __init__(self, depth=0.9e-3, right=0.8e-3, down=-1e-3, ball=3e-3, soft=60e-6):
        self.depth, self.right, self.down, self.ball, self.soft = depth, right, down, ball, soft

    def over(self, rest: np.ndarray, camera) -> np.ndarray:
        """Heights (H, W) float32 m of the pressed gel."""
        right, down = np.meshgrid(camera.right, camera.down)
        square = (right - self.right) ** 2 + (down - self.down) ** 2
        rise = self.soft * np.logaddexp(0, (self.depth - square / (2 * self.ball)) / self.soft)
        return (rest + rise).astype(np.float32)

    def on(self, camera) -> np.ndarray:
        """The same on the DIGIT's own dome."""
        return self.over(rest_height_map(camera), camera)


def with_leds(unit, **change):
    """The unit with a change of each of its LEDs, which light the gel as brightly."""
    leds = tuple(dataclasses.replace(led, **change) for led in unit.leds)
    return dataclasses.replace(unit, leds=leds).with_gain(unit.gain)


def levels(unit, radiance) -> np.ndarray:
    """Radiance (H, W, 3) or a difference of it in the picture's grey levels."""
    return np.einsum("hwcl,hwl->hwc", unit.pixel_response, radiance)
