"""A DIGIT unit of round numbers, so that tests of pictures do not depend on what ships."""

import dataclasses

from tactile_core.sensors.calibration import AMBIENT_TERMS, Calibration, Coating, Fit, Response
from tactile_core.sensors.camera import Camera, Led

LEDS = (
    Led("red", (10.8e-3, -10.9e-3, 7.0e-3), 1.0e-3, 0.0),
    Led("green", (-13.3e-3, -8.5e-3, 7.6e-3), 1.0e-3, 0.0),
    Led("blue", (1.6e-3, 14.6e-3, 5.8e-3), 1.0e-3, 0.0),
)
# Of a coating that faces an LED from the picture's middle: pictures of a 6 mm ball then change by about 100.
LEVELS = 150.0
AMBIENT = 70.0  # levels; the LEDs add about 60
ZERO = ((0.0, 0.0, 0.0),) * 3


def plain_unit(**changes: object) -> Calibration:
    """Camera 20 mm above the gel at 18.8 px/mm, three small LEDs, the same gain and ambient light all over."""
    camera = Camera(
        width=240, height=320, px_per_mm_x=18.8, px_per_mm_y=18.8, centre_x=-7.5e-3, centre_z=0.0,
        apparent_height=20e-3, right_z=-1, down_x=1,
    )  # fmt: skip
    gain = Response(tuple(tuple(LEVELS * (i == k) for k in range(3)) for i in range(3)), ZERO, ZERO)
    fit = Fit("round numbers, not fitted", (), (), 6e-3, {}, {})
    dark = ((0.0,) * AMBIENT_TERMS,) * 3
    unit = Calibration("plain", camera, LEDS, gain, dark, Coating(), 1.41, 1.0, "", (1.0, 1.0, 1.0), fit)
    unit = dataclasses.replace(unit, **changes).with_gain(gain)
    lit = tuple((AMBIENT / level, *[0.0] * (AMBIENT_TERMS - 1)) for level in unit.ambient_unit.tolist())
    return dataclasses.replace(unit, ambient=lit)
