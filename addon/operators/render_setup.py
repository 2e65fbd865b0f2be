"""Set up a scene so that rendered files hold the camera's own 8-bit values; define its settings and their panel; reset
LEDs, coating and camera to a calibration, or save them as one.

Choosing a preset or a calibration acts on the gels and workers at once.
"""

import dataclasses
import importlib.util

import bpy
from bpy_extras.io_utils import ExportHelper

from ...tactile_core.errors import TactileError
from ...tactile_core.sensors import calibration_file
from ...tactile_core.sensors.camera import COLOURS
from ..objects import digit_body, digit_materials, digit_unit
from ..settings import properties, render_settings, reports
from ..settings.reports import TactileOperator
from . import pictures
from .render_engine import ID

_FAST = ("fast", "Fast", "Direct light and soft shadows, with numpy alone")
_MITSUBA = (
    ("standard", "Standard", "Direct light, traced by Mitsuba"),
    ("quality", "Quality", "And the light that bounces once"),
    ("reference", "Reference", "Everything, seconds a frame"),
)
_PACKAGE = __package__.rsplit(".", 2)[0]
TRACED = importlib.util.find_spec(f"{_PACKAGE}.tactile_core.pictures.mitsuba") is not None
PRESETS = (_FAST, *(_MITSUBA if TRACED else ()))


class TactileRender(bpy.types.PropertyGroup):
    """Settings that the add-on stores with each scene: preset, calibration, bounds on the error."""

    preset: bpy.props.EnumProperty(
        name="Preset", description="How exactly the picture is made", items=PRESETS,
        update=lambda settings, context: _prepare(settings, context), translation_context="Tactile",
    )  # fmt: skip
    calibration: bpy.props.StringProperty(
        name="Calibration", description="File of one unit (tactile calibrate); empty: that of the sensor, or of the"
        " preferences for a DIGIT", subtype="FILE_PATH", options=properties.RELATIVE,
        update=lambda settings, context: _take_calibration(settings, context),
    )  # fmt: skip
    error: bpy.props.StringProperty(
        name="Largest Error", description="Largest error that the toolkit itself may add: 50um of a simulated surface,"
        " 0.6levels of a picture, or both with a comma. Picks tier and preset; empty: the fast tier, the preset above",
    )  # fmt: skip


def _take_calibration(settings: TactileRender, _context: bpy.types.Context) -> None:
    """Set the gels' LEDs, coating and camera by the file that was just chosen; if it is bad, a render will say so."""
    scene = settings.id_data
    for gel in [thing for thing in scene.objects if thing.tactile.role == "DIGIT"]:
        if digit_body.leds_of(gel) and gel.library is None:
            try:
                digit_body.reset(gel, render_settings.calibration_of(scene, properties.sensor_name(gel)))
            except TactileError:
                continue


def _prepare(settings: TactileRender, context: bpy.types.Context) -> None:
    """Let the worker of the preset that was just chosen get ready."""
    if settings.id_data == context.scene:
        pictures.prepare(context.scene, context.evaluated_depsgraph_get())


class OnGel:
    """Operators that need a gel"""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true if there is a gel."""
        return properties.can(cls, lambda: properties.needed_gel(context.scene))


class TACTILE_OT_reset_to_calibration(OnGel, TactileOperator):
    """Put LEDs, coating and camera back to the calibration; their keyframes and drivers are removed"""

    bl_idname = "tactile.reset_to_calibration"
    bl_label = "Reset to Calibration"

    def _work(self, context: bpy.types.Context) -> None:
        gel = properties.gel_of(context.scene, context.object)
        properties.check_own(gel, *(led.data for led in digit_body.leds_of(gel).values()))  # an override's are linked
        gel.tactile.object_reflectance = 0.0
        digit_body.reset(gel, render_settings.calibration_of(context.scene, properties.sensor_name(gel)))


class TACTILE_OT_save_as_calibration(OnGel, TactileOperator, ExportHelper):
    """Write LEDs, coating and camera as they are on this frame as a calibration file, for every `tactile` command"""

    bl_idname = "tactile.save_as_calibration"
    bl_label = "Save as Calibration"
    bl_options = {"REGISTER"}  # noqa: RUF012 (changes no scene)

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def _work(self, context: bpy.types.Context) -> None:
        gel = properties.gel_of(context.scene, context.object)
        base = render_settings.calibration_of(context.scene, properties.sensor_name(gel))
        shown = digit_unit.shown_unit(gel, context.evaluated_depsgraph_get(), base)
        path = bpy.path.abspath(self.filepath)
        unit = dataclasses.replace(shown.unit, unit=f"{base.unit}, changed in Blender") if shown.unit != base else base
        calibration_file.write_calibration(path, unit)
        if shown.around:
            self.report({"WARNING"}, "A calibration holds three LEDs of one colour each: lamps, bodies and other"
                        " colours in this scene are not in it")  # fmt: skip
        self.report({"INFO"}, f"{path}: {unit.unit}")


class TACTILE_OT_set_up_render(OnGel, TactileOperator):
    """Set the scene up to render what a gel's camera sees: engine, camera, size in pixels, and unchanged colours"""

    bl_idname = "tactile.set_up_render"
    bl_label = "Set Up Render"

    def _work(self, context: bpy.types.Context) -> None:
        scene = context.scene
        gel = properties.needed_gel(scene, context.object)
        properties.check_own(gel)
        unit = render_settings.calibration_of(scene, properties.sensor_name(gel))
        if not digit_body.has_body(gel):
            words = f"{gel.name} came without its LEDs and camera: the calibration's are added"
            self.report({"WARNING"}, f"{words}. To have its own, append its collection")
        digit_body.add_body(gel, unit)
        for words in pictures.mixed(gel, scene):
            self.report({"WARNING"}, words)
        camera = unit.camera
        render = scene.render
        render.engine = ID
        render.resolution_x, render.resolution_y, render.resolution_percentage = camera.width, camera.height, 100
        right, down = camera.pixel_size
        render.pixel_aspect_x, render.pixel_aspect_y = max(1.0, right / down), max(1.0, down / right)
        render.dither_intensity = 0.0  # noise of a grey level that the camera does not have
        # What would cut the picture, write on it or stand in its place: a region, metadata, the sequencer's strips.
        render.use_border = render.use_stamp = render.use_sequencer = False
        context.view_layer.use = True
        view, image = scene.view_settings, render.image_settings
        view.view_transform, view.look, view.exposure, view.gamma = "Raw", "None", 0.0, 1.0
        view.use_curve_mapping = False
        if bpy.app.version >= (4, 3, 0):
            view.use_white_balance = False
        image.color_management = "FOLLOW_SCENE"
        if bpy.app.version >= (5, 0, 0):  # Blender 5.0 cannot write an EXR of parts whose pixels are not square
            image.media_type, image.use_exr_interleave = "IMAGE", True
        image.file_format, image.color_mode = "PNG", "RGB"
        scene.camera = digit_body.camera_of(gel)
        self.report({"INFO"}, "View transform Raw: this engine and Cycles give the camera's own levels, EEVEE roughly")
        pictures.prepare(scene, context.evaluated_depsgraph_get())


class TACTILE_PT_render(bpy.types.Panel):
    """Preset, unit, lights and coating"""

    bl_idname = "TACTILE_PT_render"
    bl_label = "DIGIT"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true for this engine only."""
        return context.engine == ID

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel; Blender calls it."""
        draw_settings(self.layout, context)
        draw_parts(self.layout, context)


def draw_error(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the field for the largest error of simulations and pictures, and which preset keeps it."""
    scene = context.scene
    layout.prop(scene.tactile_render, "error", placeholder="50um,0.6levels")
    try:
        chosen = render_settings.preset_of(scene) if render_settings.budget_of(scene).levels is not None else ""
        words, icon = f"Preset chosen: {chosen.title()}", "CHECKMARK"
    except TactileError as error:
        chosen, words, icon = "none", reports.in_blender(str(error)), "ERROR"
    if chosen:
        layout.label(text=words, icon=icon)


def draw_settings(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the settings, in this panel and in the sidebar's; the preset is grey if a largest error chooses it."""
    settings = context.scene.tactile_render
    layout.use_property_split = True
    layout.operator(TACTILE_OT_set_up_render.bl_idname, icon="RESTRICT_RENDER_OFF")
    row = layout.row()
    row.active = not settings.error
    row.prop(settings, "preset")
    draw_error(layout, context)
    if settings.preset != "fast" and reports.missing("mitsuba"):
        layout.label(text="mitsuba is missing: see Preferences", icon="ERROR")
    layout.prop(settings, "calibration")


def draw_parts(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw fields for a gel's LEDs and coating, and buttons to reset and save them; nothing if there is no gel."""
    gel = properties.gel_of(context.scene, context.object)
    if gel is None:
        return
    layout.use_property_split = True
    leds = digit_body.leds_of(gel)
    for colour in COLOURS if leds else ():
        row = layout.row(align=True)
        if colour in leds:
            row.prop(leds[colour].data, "energy", text=f"{colour.title()} LED")
            hue = row.row()
            hue.ui_units_x = 1  # what is left holds the energy with its unit
            hue.prop(leds[colour].data, "color", text="")
        else:
            row.label(text=f"{colour.title()} LED deleted: off", icon="INFO")
    coating = digit_body.coating_of(gel) if leds else None
    for name, socket in digit_materials.sockets_of(coating).items() if coating else ():
        layout.prop(socket, "default_value", text=name)
    layout.prop(gel.tactile, "object_reflectance")
    if not digit_body.has_body(gel):
        layout.label(text="No LEDs of its own: Set Up Render adds them", icon="INFO")
    for words in digit_unit.left_out(context.scene, gel)[:3]:
        layout.label(text=words, icon="INFO")
    row = layout.row(align=True)
    row.operator("tactile.reset_to_calibration", text="Reset", icon="LOOP_BACK")
    row.operator("tactile.save_as_calibration", text="Save As", icon="FILE_TICK")


CLASSES = (
    TactileRender, TACTILE_OT_set_up_render, TACTILE_OT_reset_to_calibration, TACTILE_OT_save_as_calibration,
    TACTILE_PT_render,
)  # fmt: skip
POINTERS = ((bpy.types.Scene, "tactile_render", TactileRender),)
