"""Read the settings of a scene's pictures: preset, unit, largest error."""

import bpy

from ...tactile_core import sensors
from ...tactile_core.errors import TactileError
from ...tactile_core.jobs.error_budget import Budget, parse_budget
from ...tactile_core.sensors import calibration_file
from ...tactile_core.sensors.calibration import Calibration
from . import preferences, properties


def budget_of(scene: bpy.types.Scene) -> Budget:
    """Return the largest errors that a scene allows, of surfaces, um, and of pictures, levels. Raises TactileError if
    their text cannot be read."""
    text = scene.tactile_render.error.strip()
    return parse_budget(text) if text else Budget()


def preset_of(scene: bpy.types.Scene) -> str:
    """Return a scene's preset: if the scene has a largest error of pictures, the cheapest preset within it, else the
    chosen one. Raises TactileError if the error's text cannot be read, or if no preset is within it."""
    levels = budget_of(scene).levels
    if levels is None:
        return scene.tactile_render.preset
    from ...tactile_core.pictures import presets
    from ...tactile_core.pictures.mitsuba import variant

    # Their order by cost is the same with LLVM and without: Mitsuba need not be looked for in Blender's own process.
    return presets.cheapest(levels, variant.LLVM)


def calibration_of(scene: bpy.types.Scene, sensor: str, size: tuple[int, int] | None = None) -> Calibration:
    """Return the calibration of a gel's sensor, at a picture of ``size`` (width, height) px.

    It is that of the file that the scene names, else (for a DIGIT) that of the preferences, else the one that ships.
    Raises TactileError for a bad file, and for a file of a sensor of which the scene has no gel.
    """
    path = scene.tactile_render.calibration
    chosen = preferences.addon_preferences(bpy.context)
    if not path and sensor == sensors.TARGET and chosen is not None:
        path = chosen.calibration
    file = bpy.path.abspath(path) if path else None
    gels = {properties.sensor_name(thing) for thing in scene.objects if thing.tactile.role == "DIGIT"}
    try:
        unit = calibration_file.load_calibration(file, None if file else sensor)
        if unit.camera.sensor != sensor:  # a file of another gel in the scene is that one's alone
            unit = calibration_file.load_calibration(None if unit.camera.sensor in gels else file, sensor)
    except TactileError as error:
        advice = "Choose another as Calibration in the tab Tactile, or leave it empty"
        expected = f"a calibration file of a {sensors.title(sensor)}"
        raise TactileError(error.where, error.found, expected, advice) from error
    return unit if size is None else unit.at_size(*size)
