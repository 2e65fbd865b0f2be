"""A synthetic picture of an untouched DIGIT, made by formula: no photograph, no unit."""

from __future__ import annotations

import functools

import numpy as np

from .camera import COLOURS, DIGIT_CAMERA, DIGIT_LEDS, Camera, Led

# Grey levels. Assumed: a light's strength at the shader's unit of radiance, and the even stray light that lifts the
# darkest parts of real pictures from black.
LIGHT = 105.0
STRAY = 22.0
_BOWL_RADIUS = 21e-3  # m, the gel's dome across (sensors.md); along it counts as flat


@functools.cache
def _synthetic(camera: Camera, leds: tuple[Led, ...]) -> np.ndarray:
    right, down = np.meshgrid(camera.right, camera.down)
    height, slope = right**2 / (2 * _BOWL_RADIUS), right / _BOWL_RADIUS
    picture = np.full((*camera.shape, len(COLOURS)), STRAY)
    for led in leds:
        to_right, to_down, above = led.position[0] - right, led.position[1] - down, led.position[2] - height
        cosine = np.maximum(above - slope * to_right, 0) / np.sqrt(1 + slope**2)
        falloff = np.square(led.position).sum() / (to_right**2 + to_down**2 + above**2) ** 1.5
        picture[..., led.channel] += LIGHT * np.sqrt(cosine * falloff)
    picture = np.rint(picture).clip(0, 255).astype(np.uint8)
    picture.flags.writeable = False
    return picture


def synthetic_background(camera: Camera = DIGIT_CAMERA, leds: tuple[Led, ...] = DIGIT_LEDS) -> np.ndarray:
    """Background (H, W, 3) uint8: each LED's light on a matte cylinder of the dome's radius, and even stray light.

    Lambert's cosine and inverse square of distance, evened out by a square root (assumed: the acrylic's rough edge
    spreads the light of a real unit about as much); one formula a pixel, so smooth, and the same on every call.
    """
    return _synthetic(camera, tuple(leds)).copy()
