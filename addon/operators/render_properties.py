"""Properties of a scene's render panel: preset, unit, largest error; a choice acts on the gels and workers at once."""

import importlib.util

import bpy

from ...tactile_core.errors import TactileError
from ..objects import digit_body
from ..settings import properties
from ..settings.render_settings import calibration_of
from . import pictures

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


def _take_calibration(settings: TactileRender, _context: bpy.types.Context) -> None:
    """Put LEDs, coating and camera to those of the file that was chosen; a bad file is reported by a render."""
    scene = settings.id_data
    for gel in [thing for thing in scene.objects if thing.tactile.role == "DIGIT"]:
        if digit_body.leds_of(gel) and gel.library is None:
            try:
                digit_body.reset(gel, calibration_of(scene, properties.sensor_name(gel)))
            except TactileError:
                continue


def _prepare(settings: TactileRender, context: bpy.types.Context) -> None:
    """Let the worker of the preset that was chosen get ready."""
    if settings.id_data == context.scene:
        pictures.prepare(context.scene, context.evaluated_depsgraph_get())


CLASSES = (TactileRender,)
POINTERS = ((bpy.types.Scene, "tactile_render", TactileRender),)
