"""The picture of a gel as the scene has it now: its dent, and its LEDs, coating and camera as they stand."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ...tactile_core.pictures import height_map, shading
from ...tactile_core.sensors.calibration import Calibration
from ..objects import digit_objects, digit_unit, images
from ..process import tracer_process
from ..ui import render_settings, reports

FAST = "fast"
_shaders: dict[str, shading.Shader] = {}  # one at most: the frames of an animation share it


def shader_of(unit: Calibration) -> shading.Shader:
    """Return the fast shader of a unit."""
    key = repr(unit)  # a calibration holds tables, which have no hash
    if key not in _shaders:
        _shaders.clear()
        _shaders[key] = shading.Shader(unit)
    return _shaders[key]


def draw(
    gel: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    preset: str,
    size: tuple[int, int] | None = None,
    stopped: Callable[[], bool] = lambda: False,
    better: Callable[[np.ndarray], None] = lambda picture: None,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw a gel's picture (H, W, 3) uint8 and heights (H, W) m, (width, height) pixels large, by a preset.

    The fast preset draws LEDs, coating and camera; lamps and bodies beside them need Mitsuba. Pictures that get better,
    up to the one that is returned, are given to better(). Raises TactileError, and ``tracer_process.Stopped`` where
    stopped() is true.
    """
    shown = digit_unit.shown_unit(gel, depsgraph, render_settings.calibration_of(depsgraph.scene, size))
    heights = height_map.height_map(digit_objects.displacement_of(gel, depsgraph), shown.unit.camera)
    if preset == FAST:
        return shader_of(shown.unit)(heights), heights
    reports.require("mitsuba")
    if not bpy.app.background:
        better(shader_of(shown.unit)(heights))
    return tracer_process.draw(preset, shown.unit, shown.around, heights, stopped, better), heights


def update(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Image:
    """Draw fast picture and height map of the current frame into their datablocks; returns the picture's."""
    picture, heights = draw(gel, depsgraph, FAST)
    images.show_heights(heights)
    return images.show_picture(picture)
