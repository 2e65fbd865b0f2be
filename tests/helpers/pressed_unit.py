"""Photographs of a unit whose numbers are known: balls pressed into it, rendered by the fast picture."""

from pathlib import Path

import numpy as np
from PIL import Image

from tactile_core.pictures.calibrate.ball_print import print_on
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Calibration

BALL = 3e-3  # m, radius
GREY = 128  # level of the untouched gel
PLACES = ((0.0, 0.0, 0.9), (-3.0, -4.0, 1.0), (3.2, -3.5, 0.8), (-3.1, 4.2, 1.1), (2.8, 3.9, 1.0))  # mm


def photograph(
    unit: Calibration, place: tuple[float, float, float], noise: np.random.Generator | None = None
) -> np.ndarray:
    """Picture (H, W, 3) uint8 of a ball at right, down, depth in mm."""
    rest = rest_height_map(unit.camera)
    right, down = np.meshgrid(unit.camera.right, unit.camera.down)
    at_right, at_down, depth = (1e-3 * value for value in place)
    return drawn(unit, print_on(rest, right, down, (at_right, at_down, depth, BALL)), noise)


def drawn(unit: Calibration, heights: np.ndarray, noise: np.random.Generator | None) -> np.ndarray:
    """Fast picture (H, W, 3) uint8 of heights (H, W) m."""
    renderer = Renderer(unit, "fast", background=np.full((*unit.camera.shape, 3), GREY))
    return renderer.picture(renderer.radiance(heights), noise)


def write_photographs(folder: Path, unit: Calibration, places: tuple = PLACES) -> Path:
    """press_0.png, press_1.png ... and untouched.png beside the folder; with the camera's noise. Returns the folder."""
    folder.mkdir()
    noise = np.random.default_rng(0)
    for k, place in enumerate(places):
        Image.fromarray(photograph(unit, place, noise)).save(folder / f"press_{k}.png")
    untouched = drawn(unit, rest_height_map(unit.camera), noise)
    Image.fromarray(untouched).save(folder.parent / "untouched.png")
    return folder
