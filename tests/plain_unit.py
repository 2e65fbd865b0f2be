"""A DIGIT unit of round numbers, so that tests of pictures do not depend on what ships."""

from __future__ import annotations

import dataclasses

from tactile_core.sensors.calibration import BACKGROUND_TERMS, Background, Calibration, Fit, Gain
from tactile_core.sensors.camera import Camera, Led

LEDS = (
    Led("red", (10.8e-3, -10.9e-3, 7.0e-3), 1.0e-3),
    Led("green", (-13.3e-3, -8.5e-3, 7.6e-3), 1.0e-3),
    Led("blue", (1.6e-3, 14.6e-3, 5.8e-3), 1.0e-3),
)
LEVELS = 150.0  # grey levels a unit of radiance: pictures of a 6 mm ball then change by about 100 levels
ZERO = ((0.0, 0.0, 0.0),) * 3


def plain_unit(**changes: object) -> Calibration:
    """Camera 20 mm above the gel at 18.8 px/mm, three small LEDs, the same gain all over, a grey background."""
    camera = Camera(
        width=240, height=320, px_per_mm_x=18.8, px_per_mm_y=18.8, centre_x=-7.5e-3, centre_z=0.0,
        apparent_height=20e-3, right_z=-1, down_x=1,
    )  # fmt: skip
    gain = Gain(tuple(tuple(LEVELS * (i == k) for k in range(3)) for i in range(3)), ZERO, ZERO)
    grey = ((128.0, *[0.0] * (BACKGROUND_TERMS - 1)),) * 3
    fit = Fit("round numbers, not fitted", (), 6e-3, {}, {}, ())
    unit = Calibration("plain", camera, LEDS, gain, 1.0, 0.5, Background(grey), (1.0, 1.0, 1.0), fit)
    return dataclasses.replace(unit, **changes)
