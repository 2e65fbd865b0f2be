"""Settings of a scene's pictures: preset, unit, largest error."""

import importlib.util

import bpy

from ...tactile_core import sensors
from ...tactile_core.errors import TactileError
from ...tactile_core.jobs.error_budget import Budget, parse_budget
from ...tactile_core.sensors import calibration_file
from ...tactile_core.sensors.calibration import Calibration
from ..objects import digit_body
from . import preferences, properties

_FAST = ("fast", "Fast", "Direct light and soft shadows, with numpy alone")
_MITSUBA = (
    ("standard", "Standard", "Direct light, traced by Mitsuba"),
    ("quality", "Quality", "And the light that bounces once"),
    ("reference", "Reference", "Everything, seconds a frame"),
)
_PACKAGE = __package__.rsplit(".", 2)[0]
TRACED = importlib.util.find_spec(f"{_PACKAGE}.tactile_core.pictures.mitsuba") is not None
PRESETS = (_FAST, *(_MITSUBA if TRACED else ()))
_RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


class TactileRender(bpy.types.PropertyGroup):
    """Render settings of each scene."""

    preset: bpy.props.EnumProperty(
        name="Preset", description="How exactly the picture is made", items=PRESETS,
        update=lambda settings, context: _prepare(settings, context),
    )  # fmt: skip
    calibration: bpy.props.StringProperty(
        name="Calibration", description="File of one unit (tactile calibrate); empty: that of the sensor, or of the"
        " preferences for a DIGIT", subtype="FILE_PATH", options=_RELATIVE,
        update=lambda settings, context: _take_calibration(settings, context),
    )  # fmt: skip
    error: bpy.props.StringProperty(
        name="Largest Error", description="Largest error that the toolkit itself may add: 50um of a simulated surface,"
        " 0.6levels of a picture, or both with a comma. Picks tier and preset; empty: the fast tier, the preset above",
    )  # fmt: skip


def budget_of(scene: bpy.types.Scene) -> Budget:
    """Return the bound that a scene's panel holds. Raises TactileError for anything else than bounds."""
    text = scene.tactile_render.error.strip()
    return parse_budget(text) if text else Budget()


def preset_of(scene: bpy.types.Scene) -> str:
    """Return a scene's preset, or the cheapest within its bound on pictures. Raises TactileError."""
    levels = budget_of(scene).levels
    if levels is None:
        return scene.tactile_render.preset
    from ...tactile_core.pictures import presets
    from ...tactile_core.pictures.mitsuba import variant

    # Their order by cost is the same with LLVM and without: Mitsuba need not be looked for in Blender's own process.
    return presets.cheapest(levels, variant.LLVM)


def calibration_of(scene: bpy.types.Scene, sensor: str, size: tuple[int, int] | None = None) -> Calibration:
    """Return a gel's unit, its picture (width, height) pixels large: of the file that a scene names for such a gel.

    Else the preferences', of a DIGIT, or that of the sensor's descriptor. Raises TactileError, also for a file of a
    sensor that the scene has no gel of.
    """
    path = scene.tactile_render.calibration
    if not path and sensor == sensors.TARGET:
        path = preferences.default_calibration(bpy.context)
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


def _take_calibration(settings: TactileRender, _context: bpy.types.Context) -> None:
    """Put LEDs, coating and camera to those of the file that was chosen; one that is none is reported by a render."""
    scene = settings.id_data
    for gel in [thing for thing in scene.objects if thing.tactile.role == "DIGIT"]:
        if digit_body.leds_of(gel) and gel.library is None:
            try:
                digit_body.reset(gel, calibration_of(scene, properties.sensor_name(gel)))
            except TactileError:
                continue


def _prepare(settings: TactileRender, context: bpy.types.Context) -> None:
    """Let the worker of the preset that was chosen get ready."""
    from ..operators import pictures

    if settings.id_data == context.scene:
        pictures.prepare(context.scene, context.evaluated_depsgraph_get())


CLASSES = (TactileRender,)
POINTERS = ((bpy.types.Scene, "tactile_render", TactileRender),)
