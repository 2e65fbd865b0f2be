"""Measure time and memory of a pressed ball's picture, at 480 x 640, by others' programs on PyPI and by ours.

    pip install "taxim[jax-cpu]"
    python scripts/benchmark.py --only peers --json FILE

Each draws a GelSight Mini by a calibration of its own, of another unit, so that errors cannot be compared.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.presets import FAST
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration_file import load_calibration

from .method import Method, best_ms, peak_mb

NAMES = "ours", "taxim", "taxim_shadows"
SIZE = 480, 640  # of Taxim's GelSight Mini, px
RADIUS, DEPTH, PITCH = 4.0, 0.5, 0.0295  # mm, mm, mm per pixel


def measure(name: str, quick: bool) -> Method:
    """Measure time and memory of the program "ours", "taxim" or "taxim_shadows". quick : not used. Raises
    ModuleNotFoundError if the program is not installed."""
    draw = _ours() if name == "ours" else _taxim(name == "taxim_shadows")
    ms, mb = best_ms(draw), peak_mb()
    return Method("peers", name, ms, mb, None, "levels", None, "a ball of 4 mm, 0.5 mm deep, 480 x 640")


def _print() -> np.ndarray:
    """Return the height (480, 640) mm of the ball's surface over the untouched gel; below 0 it is pressed in."""
    v, u = (PITCH * (np.arange(count) - count / 2) for count in SIZE)
    away = np.minimum(np.hypot(*np.meshgrid(u, v)), RADIUS)
    return RADIUS - np.sqrt(RADIUS**2 - away**2) - DEPTH


def _ours() -> Callable[[], object]:
    unit = load_calibration(sensor="gelsight_mini").at_size(*SIZE[::-1])
    renderer = Renderer(unit, FAST)
    heights = rest_height_map(unit.camera) + 1e-3 * np.minimum(_print(), 0)
    return lambda: renderer(heights)


def _taxim(shadows: bool) -> Callable[[], object]:
    import jax
    from taxim import CALIB_GELSIGHT_MINI, Taxim

    program = Taxim(CALIB_GELSIGHT_MINI, backend="jax", device="cpu")
    heights = program.convert_height_map(_print())
    return lambda: jax.block_until_ready(program.render(heights, with_shadow=shadows, press_depth=DEPTH))
