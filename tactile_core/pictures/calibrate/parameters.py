"""The numbers of a calibration that enter its pictures in a nonlinear way, as one vector in the units of its file."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...sensors.calibration import Calibration
from ...sensors.camera import COLOURS

# name, standard deviation of units round the calibration that a fit starts from (assumed, but for the scale: 17 to
# 21 px/mm, docs/sources.md, DIGIT camera), step of the differences that make the Jacobian
CAMERA = (("px_per_mm_x", 0.7, 0.02), ("px_per_mm_y", 0.7, 0.02), ("apparent_height_mm", 4.0, 0.2))
GEL = (("dome_scale", 0.1, 0.02),)
COATING = (("albedo", 0.15, 0.05), ("spread_mm", 0.15, 0.02))
LED = (("right_mm", 2.0, 0.05), ("down_mm", 2.0, 0.05), ("up_mm", 1.0, 0.05), ("radius_mm", 1.0, 0.05),
       ("rise_per_mm", 0.2, 0.02))  # fmt: skip
LEDS = tuple((f"{colour}_{name}", spread, step) for colour in COLOURS for name, spread, step in LED)

PARAMETERS = (*CAMERA, *GEL, *COATING, *LEDS)
NAMES = tuple(name for name, _, _ in PARAMETERS)
SPREAD = np.array([spread for _, spread, _ in PARAMETERS])
STEP = np.array([step for _, _, step in PARAMETERS])
FIRST_LED, PER_LED = len(CAMERA) + len(GEL) + len(COATING), len(LED)
# Numbers that a picture tells in one step: those of the three LEDs, each in a band of its own, go together.
TOGETHER = (
    *((k,) for k in range(FIRST_LED)),
    *(tuple(range(FIRST_LED + k, len(NAMES), PER_LED)) for k in range(PER_LED)),
)
SMALLEST_RADIUS, LARGEST_RADIUS = 0.1, 8.0  # mm; the gel's window is 18 mm wide


def parameters_of(calibration: Calibration) -> np.ndarray:
    """Return the vector (21,) of a calibration, in the order of NAMES."""
    camera = calibration.camera
    lights = zip(calibration.leds, calibration.ambient_rise, strict=True)
    leds = [value for led, rise in lights for value in (*(1e3 * mm for mm in (*led.position, led.radius)), 1e-3 * rise)]
    head = [camera.px_per_mm_x, camera.px_per_mm_y, 1e3 * camera.apparent_height, calibration.dome_scale]
    head += [float(np.mean(calibration.coating.albedo)), 1e3 * calibration.coating.spread]
    return np.array([*head, *leds])


def with_parameters(calibration: Calibration, numbers: np.ndarray) -> Calibration:
    """Return a calibration with other numbers and the same gain; raises TactileError for some that mean nothing."""
    scale_x, scale_y, height, dome, albedo, spread = (float(value) for value in numbers[:FIRST_LED])
    shares = np.asarray(calibration.coating.albedo)
    of_red, of_green, of_blue = (shares * (albedo / shares.mean())).tolist()
    coating = dataclasses.replace(calibration.coating, albedo=(of_red, of_green, of_blue), spread=1e-3 * spread)
    camera = dataclasses.replace(
        calibration.camera, px_per_mm_x=scale_x, px_per_mm_y=scale_y, apparent_height=1e-3 * height
    )
    rows = numbers[FIRST_LED:].reshape(3, PER_LED).tolist()
    red, green, blue = (
        dataclasses.replace(led, position=(1e-3 * x, 1e-3 * y, 1e-3 * z), radius=1e-3 * radius)
        for led, (x, y, z, radius, _) in zip(calibration.leds, rows, strict=True)
    )
    rise_red, rise_green, rise_blue = (1e3 * row[-1] for row in rows)
    changed = dataclasses.replace(
        calibration, camera=camera, leds=(red, green, blue), dome_scale=dome, coating=coating,
        ambient_rise=(rise_red, rise_green, rise_blue),
    )  # fmt: skip
    return changed.with_gain(calibration.gain)
