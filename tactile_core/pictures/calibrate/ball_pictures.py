"""A unit under test: pictures of balls pressed into it, by the fast model, and their change with single numbers."""

from __future__ import annotations

import numpy as np

from ...sensors.calibration import Calibration
from ...sensors.camera import HEIGHT_ZERO_Y, Camera, Led
from ...sensors.digit import BACK_Y, dome_height
from ..perspective import Perspective
from ..shading import Lamp, SeenSurface
from .ball_print import print_on

WORKING_WIDTH = 120  # px: fits look at pictures made smaller by whole factors down to this width


class BallPictures:
    """The fast picture of ``shading`` taken apart: gel, view and lamps of one calibration."""

    def __init__(self, calibration: Calibration) -> None:
        self.calibration = calibration
        self.camera: Camera = calibration.camera
        x, z = np.meshgrid(self.camera.gel_x, self.camera.gel_z, indexing="ij")
        self.rest = (calibration.dome_scale * (BACK_Y - dome_height(x, z) - HEIGHT_ZERO_Y)).astype(np.float32)
        self.right, self.down = np.meshgrid(self.camera.right, self.camera.down)
        self.view = Perspective(self.camera, self.rest)
        self._flat = SeenSurface(self.view, self.view(self.rest))
        self.lamps = [self.lamp(led) for led in calibration.leds]
        self.gain = np.moveaxis(calibration.gain.matrices(self.camera), (2, 3), (0, 1))

    def lamp(self, led: Led) -> tuple[Lamp, np.ndarray]:
        """A lamp in place of the calibration's, and its radiance (H, W) on the resting gel."""
        lamp = Lamp(self.camera, led)
        return lamp, lamp.radiance(self._flat)

    def surface(self, ball: tuple[float, float, float, float]) -> SeenSurface:
        """The gel that the pixels see under a ball (right, down, depth, radius), m."""
        return SeenSurface(self.view, self.view(print_on(self.rest, self.right, self.down, ball)))

    def light(self, surface: SeenSurface, lamp: tuple[Lamp, np.ndarray]) -> np.ndarray:
        """Change (H, W) of one lamp's radiance by a press."""
        return lamp[0].radiance(surface) - lamp[1]

    def lights(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Change (3, H, W) of the radiance by a press."""
        surface = self.surface(ball)
        return np.stack([self.light(surface, lamp) for lamp in self.lamps])

    def change(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Change (H, W, 3) of the picture by a press, grey levels."""
        return np.einsum("clhw,lhw->hwc", self.gain, self.lights(ball), optimize=True)


def working_factor(width: int, height: int) -> int:
    """The whole factor by which pictures are made smaller for a fit."""
    wanted = max(width // WORKING_WIDTH, 1)
    return next(factor for factor in range(wanted, 0, -1) if width % factor == 0 and height % factor == 0)


def smaller(values: np.ndarray, factor: int) -> np.ndarray:
    """Means of values (H, W, ...) over squares of factor x factor pixels."""
    height, width = values.shape[0] // factor, values.shape[1] // factor
    blocks = values.reshape(height, factor, width, factor, *values.shape[2:])
    return blocks.mean((1, 3), dtype=np.float32)
