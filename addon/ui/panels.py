"""The tab "Tactile" in the 3D view's sidebar."""

import json
import math
import textwrap

import bpy

from ...tactile_core.errors import TactileError
from ...tactile_core.translation import trust_words
from ..objects import mesh_cache, style_nodes, styles
from ..operators import preview, render_setup, snap_to_gel, view
from ..operators.import_recording import TACTILE_OT_import_recording
from ..operators.preview import TACTILE_OT_live_picture
from ..operators.render_setup import draw_parts, draw_settings
from ..operators.scene_files import TACTILE_OT_export_scene, TACTILE_OT_import_scene
from ..operators.simulate import TACTILE_OT_simulate
from ..operators.translate_imported import TACTILE_OT_translate
from ..settings import properties
from ..settings.reports import missing
from .add_menu import TACTILE_MT_add
from .workspace import TACTILE_OT_open_workspace


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = view.TAB


class TACTILE_PT_recording(_Panel, bpy.types.Panel):
    """Import and translate"""

    bl_idname = "TACTILE_PT_recording"
    bl_label = "Recording"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel; Blender calls it."""
        layout = self.layout
        row = layout.row(align=True)
        row.operator(TACTILE_OT_import_recording.bl_idname, icon="IMPORT")
        row.operator(TACTILE_OT_open_workspace.bl_idname, text="", icon="WORKSPACE")
        skin = properties.of_role(context.scene, "BIOTAC", context.object)
        if skin is not None and skin.tactile.recording:
            box = layout.column(align=True)
            box.prop(skin.tactile, "recording", text="")
            box.prop(skin.tactile, "tare")
            box.prop(skin.tactile, "polarity")
            for name in ("columns", "unit", "apart", "two", "ball", "weights"):
                box.prop(skin.tactile, name)
        row = layout.row(align=True)
        row.operator(TACTILE_OT_translate.bl_idname, icon="MOD_MESHDEFORM")
        row.operator_menu_enum(TACTILE_OT_translate.bl_idname, "to", text="", icon="DOWNARROW_HLT")
        row = layout.row(align=True)
        row.operator_menu_enum("tactile.set_style", "style", icon="COLOR")
        row.operator("tactile.force_arrow", text="", icon="EMPTY_SINGLE_ARROW")
        _exaggeration(layout, skin)
        _exaggeration(layout, properties.gel_of(context.scene, context.object))
        _numbers(layout, context, skin)
        try:
            mesh_cache.check(skin, properties.gel_of(context.scene, context.object))
        except TactileError as error:
            _text(layout, context, str(error), "ERROR")


def _exaggeration(layout: bpy.types.UILayout, sensor: bpy.types.Object | None) -> None:
    """Draw the field for how many times a sensor's style enlarges its dent: an input of the style's modifier."""
    modifier = sensor.modifiers.get(styles.MODIFIER) if sensor is not None else None
    if modifier is None or modifier.node_group is None:
        return
    if style_nodes.EXAGGERATION in modifier.node_group.interface.items_tree:  # a group of the user's own has none
        holder, name = style_nodes.input_property(modifier, style_nodes.EXAGGERATION)
        layout.prop(holder, name, text=f"{sensor.name}: Exaggeration")


def _numbers(layout: bpy.types.UILayout, context: bpy.types.Context, skin: bpy.types.Object | None) -> None:
    """Draw the current frame's force, and how far to trust its translation to the gel, else to the skin."""
    gel = properties.gel_of(context.scene, context.object or skin)
    if skin is None or (gel is not None and gel == context.object and _of_another(skin, gel)):
        skin = gel  # copied or pasted without its skin
    if skin is None or "force" not in skin:
        return
    size = sum(part * part for part in skin["force"]) ** 0.5
    column = layout.column(align=True)
    column.label(text=f"Force {size:.3f} N", icon="FORCE_FORCE")
    words, guess = trust_of(skin, gel)
    _text(column, context, words, "ERROR" if guess else "CHECKMARK")
    for line in numbers_of(skin) if words else ():
        _text(column, context, line)
    for line in skin.tactile.known.splitlines():
        _text(column, context, line, "OUTLINER_DATA_LATTICE")


def trust_of(skin: bpy.types.Object, gel: bpy.types.Object | None) -> tuple[str, bool]:
    """Return words on how far to trust the current frame, the same as on a contact sheet, and true if it is a guess;
    ("", False) for simulated sensors. gel : the one whose values are used; None for the skin's"""
    told = gel is not None and "expected_error_um" in gel
    shown = gel if told and not _of_another(skin, gel) else skin
    if "expected_error_um" not in shown:
        return "", False
    error, dent = (1e-6 * shown.get(name, math.nan) for name in ("expected_error_um", "dent_um"))
    trust = shown["confidence"], int(shown.get("flags", 0)), error, dent
    words = trust_words.in_words(*trust, skin["force"])
    return words, trust_words.is_guess(*trust)


def _of_another(skin: bpy.types.Object, gel: bpy.types.Object) -> bool:
    """Return true if a gel was translated from another recording than an imported skin's: it has another force."""
    told = "expected_error_um" in skin and "expected_error_um" in gel
    return told and [*gel.get("force", ())] != [*skin["force"]]


def numbers_of(skin: bpy.types.Object) -> list[str]:
    """Return an imported skin's numbers of this frame in words: confidence, share explained, second contact, flags."""
    lines = [f"Confidence {skin['confidence']:.2f}"]
    if any(skin["force"]) and "explained" in skin:
        lines[0] += f", {100 * skin['explained']:.0f} % of the signals explained"
    if skin.tactile.two and any(skin.get("second_force", ())):
        x, z = skin["second_center_mm"]
        lines.append(f"Second contact: {math.hypot(*skin['second_force']):.2f} N, x {x:.1f} mm, z {z:.1f} mm")
    flags = trust_words.remarks(int(skin["flags"]))
    return [*lines, f"Flags: {', '.join(flags)}"] if flags else lines


def _text(column: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "BLANK1") -> None:
    """Draw a text in lines that fit the panel; icon : Blender's name of the one beside the first line"""
    scale = context.preferences.system.ui_scale
    for line in textwrap.wrap(text, max(16, int((context.region.width / scale - 82) / 6.2))):
        column.label(text=line, icon=icon)
        icon = "BLANK1"


class TACTILE_PT_picture(_Panel, bpy.types.Panel):
    """Picture that the gel's camera sees"""

    bl_idname = "TACTILE_PT_picture"
    bl_label = "Picture"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel; Blender calls it."""
        layout = self.layout
        layout.operator(TACTILE_OT_live_picture.bl_idname, icon="HIDE_OFF" if preview.is_on() else "HIDE_ON",
                        depress=preview.is_on())  # fmt: skip
        words = preview.failure()
        if preview.is_on() and properties.gel_of(context.scene) is None:
            words = "No gel in this scene: its picture is from before"
        if words:
            _text(layout, context, words, "ERROR")
        draw_settings(layout, context)


class TACTILE_PT_parts(_Panel, bpy.types.Panel):
    """LEDs and coating of the gel's sensor"""

    bl_idname = "TACTILE_PT_parts"
    bl_label = "Lights and Coating"
    bl_parent_id = TACTILE_PT_picture.bl_idname
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 (Blender reads plain class attributes)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true if there is a gel."""
        return properties.gel_of(context.scene, context.object) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel; Blender calls it."""
        draw_parts(self.layout, context)


def _shape(spec: str) -> str:
    """Return an indenter's kind and sizes in words, such as "sphere, radius 3 mm"."""
    about = json.loads(spec)
    sizes = [f"{name[:-3].replace('_', ' ')} {value} mm" for name, value in about.items() if name.endswith("_mm")]
    return ", ".join([about["kind"].replace("_", " "), *sizes])


class TACTILE_PT_author(_Panel, bpy.types.Panel):
    """Author and simulate a contact"""

    bl_idname = "TACTILE_PT_author"
    bl_label = "Author"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel; Blender calls it."""
        layout = self.layout
        layout.menu(TACTILE_MT_add.bl_idname, text="Add Sensor or Indenter", icon="ADD")
        thing = properties.of_role(context.scene, "INDENTER", context.object)
        if thing is not None:
            _indenter(layout.column(), context, thing)
        layout.operator(TACTILE_OT_simulate.bl_idname, icon="PHYSICS")
        row = layout.row(align=True)
        row.operator(TACTILE_OT_import_scene.bl_idname, text="Import Scene", icon="IMPORT")
        row.operator(TACTILE_OT_export_scene.bl_idname, text="Export Scene", icon="EXPORT")


def _indenter(column: bpy.types.UILayout, context: bpy.types.Context, thing: bpy.types.Object) -> None:
    """Draw what presses, and how."""
    shape = _shape(thing.tactile.spec) if thing.tactile.spec else "its own mesh"
    column.label(text=f"{thing.name}: {shape}", icon="MESH_ICOSPHERE")
    fields = column.column()
    fields.use_property_split, fields.use_property_decorate = True, False
    fields.prop(thing.tactile, "press_by")
    if thing.tactile.press_by == "FORCE":
        fields.prop(thing.tactile, "force", text="Force (N)")
    fields.prop(thing.tactile, "friction")
    fields.prop(thing.tactile, "tilt")
    render_setup.draw_error(fields, context)
    _depth(column, context, thing)
    if thing.tactile.spec:
        column.operator("tactile.use_as_indenter", text="Press with the Mesh as It Is", icon="MESH_MONKEY")


def _depth(column: bpy.types.UILayout, context: bpy.types.Context, thing: bpy.types.Object) -> None:
    """Draw how deep an indenter stands in the resting gel on this frame, and the button that puts it there."""
    if not missing("msgspec"):
        depth = snap_to_gel.depth_of(context, thing)
        if depth is not None:
            side = "above" if depth < 0 else "below"
            column.label(text=f"{1e3 * abs(depth):.2f} mm {side} the resting gel", icon="DRIVER_DISTANCE")
    column.operator("tactile.snap_to_gel", icon="SNAP_ON")


CLASSES = (TACTILE_PT_recording, TACTILE_PT_picture, TACTILE_PT_parts, TACTILE_PT_author)
