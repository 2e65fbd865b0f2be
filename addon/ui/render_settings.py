"""Settings of a scene's DIGIT pictures: preset, unit, lights, coating."""

import dataclasses
import importlib.util

import bpy

from ...tactile_core import accuracy
from ...tactile_core.sensors import calibration_file
from ...tactile_core.sensors.calibration import Calibration

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

    preset: bpy.props.EnumProperty(name="Preset", description="How exactly the picture is made", items=PRESETS)
    calibration: bpy.props.StringProperty(
        name="Calibration", description="File of one DIGIT unit (tactile calibrate); empty: the one that ships",
        subtype="FILE_PATH", options=_RELATIVE,
    )  # fmt: skip
    error: bpy.props.StringProperty(
        name="Error", description="Largest error that the toolkit itself may add: 50um of a simulated surface,"
        " 0.6levels of a picture, or both with a comma. Picks tier and preset; empty: the fast tier, the preset above",
    )  # fmt: skip
    lights: bpy.props.FloatVectorProperty(
        name="Lights", description="Strength of the red, green and blue LED, times that of the calibration", size=3,
        default=(1.0, 1.0, 1.0), min=0.0, soft_max=2.0,
    )  # fmt: skip
    albedo: bpy.props.FloatProperty(
        name="Coating", description="Share of light that the coating scatters back; negative: the calibration's",
        default=-1.0, min=-1.0, max=1.0,
    )  # fmt: skip


def budget_of(scene: bpy.types.Scene) -> accuracy.Budget:
    """The bound that a scene's panel holds. Raises TactileError for anything else than bounds."""
    text = scene.tactile_render.error.strip()
    return accuracy.parse_budget(text) if text else accuracy.Budget()


def preset_of(scene: bpy.types.Scene) -> str:
    """Return a scene's preset, or the cheapest within its bound on pictures. Raises TactileError."""
    levels = budget_of(scene).levels
    if levels is None:
        return scene.tactile_render.preset
    from ...tactile_core.pictures import presets
    from ...tactile_core.pictures.mitsuba import variant

    # Their order by cost is the same with LLVM and without: Mitsuba need not be looked for in Blender's own process.
    return presets.cheapest(levels, variant.LLVM)


def calibration_of(scene: bpy.types.Scene, size: tuple[int, int] | None = None) -> Calibration:
    """The unit that a scene renders with, its picture (width, height) pixels large. Raises TactileError."""
    settings = scene.tactile_render
    path = bpy.path.abspath(settings.calibration) if settings.calibration else None
    unit = calibration_file.load_calibration(path)
    unit = unit if size is None else unit.at_size(*size)
    leds = tuple(
        dataclasses.replace(led, radiance=led.radiance * share)
        for led, share in zip(unit.leds, settings.lights, strict=True)
    )
    coating = unit.coating
    if settings.albedo >= 0:
        coating = dataclasses.replace(coating, albedo=(settings.albedo,) * 3)
    changed = (leds, coating) != (unit.leds, unit.coating)
    # A photograph shows the unit's own lights and coating: with others the picture at rest is the model's.
    photograph = "" if changed else unit.photograph
    return dataclasses.replace(unit, leds=leds, coating=coating, photograph=photograph)


def register() -> None:
    """Called by the package."""
    bpy.utils.register_class(TactileRender)
    bpy.types.Scene.tactile_render = bpy.props.PointerProperty(type=TactileRender, name="Tactile render")


def unregister() -> None:
    """Called by the package."""
    del bpy.types.Scene.tactile_render
    bpy.utils.unregister_class(TactileRender)
