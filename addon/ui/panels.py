"""The tab "Tactile" in the 3D view's sidebar."""

import json

import bpy

from ..operators import preview, snap_to_gel
from ..operators.import_recording import TACTILE_OT_import_recording
from ..operators.preview import TACTILE_OT_live_picture
from ..operators.render_setup import draw_settings
from ..operators.scene_files import TACTILE_OT_export_scene, TACTILE_OT_import_scene
from ..operators.simulate import TACTILE_OT_simulate
from ..operators.translate_recording import TACTILE_OT_translate
from . import properties, timeline
from .add_menu import TACTILE_MT_add
from .reports import missing


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Tactile"


class TACTILE_PT_recording(_Panel, bpy.types.Panel):
    """Import and translate"""

    bl_idname = "TACTILE_PT_recording"
    bl_label = "Recording"

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender."""
        layout = self.layout
        layout.operator(TACTILE_OT_import_recording.bl_idname, icon="IMPORT")
        skin = properties.of_role(context.scene, "BIOTAC", context.object)
        if skin is not None and skin.tactile.recording:
            box = layout.column(align=True)
            box.prop(skin.tactile, "recording", text="")
            box.prop(skin.tactile, "tare")
            box.prop(skin.tactile, "polarity")
        layout.operator(TACTILE_OT_translate.bl_idname, icon="MOD_MESHDEFORM")
        row = layout.row(align=True)
        row.operator_menu_enum("tactile.set_style", "style", icon="COLOR")
        row.operator("tactile.force_arrow", text="", icon="EMPTY_SINGLE_ARROW")
        _numbers(layout, skin)


def _numbers(layout: bpy.types.UILayout, skin: bpy.types.Object | None) -> None:
    """The current frame's force, confidence, and how far a node may be off."""
    if skin is None or "force" not in skin:
        return
    force = skin["force"]
    size = sum(part * part for part in force) ** 0.5
    column = layout.column(align=True)
    column.label(text=f"Force {size:.3f} N", icon="FORCE_FORCE")
    if "confidence" in skin:
        trusted = skin["confidence"] >= timeline.LOW
        words = "Signals like those of the training" if trusted else "Signals far from the training's: a guess"
        if "expected_error_um" in skin:
            words += f", expected error {1e-3 * skin['expected_error_um']:.2f} mm"
        column.label(text=words, icon="CHECKMARK" if trusted else "ERROR")


class TACTILE_PT_picture(_Panel, bpy.types.Panel):
    """Picture that the DIGIT's camera sees"""

    bl_idname = "TACTILE_PT_picture"
    bl_label = "Picture"

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender."""
        layout = self.layout
        layout.operator(TACTILE_OT_live_picture.bl_idname, icon="HIDE_OFF" if preview.is_on() else "HIDE_ON",
                        depress=preview.is_on())  # fmt: skip
        if preview.failure():
            layout.label(text=preview.failure(), icon="ERROR")
        draw_settings(layout, context)


def _shape(spec: str) -> str:
    """An indenter's kind and sizes: "sphere, radius 3 mm"."""
    about = json.loads(spec)
    sizes = [f"{name[:-3].replace('_', ' ')} {value} mm" for name, value in about.items() if name.endswith("_mm")]
    return ", ".join([about["kind"].replace("_", " "), *sizes])


class TACTILE_PT_author(_Panel, bpy.types.Panel):
    """Author and simulate a contact"""

    bl_idname = "TACTILE_PT_author"
    bl_label = "Author"

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender."""
        layout = self.layout
        layout.menu(TACTILE_MT_add.bl_idname, text="Add Sensor or Indenter", icon="ADD")
        thing = properties.of_role(context.scene, "INDENTER", context.object)
        if thing is not None:
            column = layout.column(align=True)
            column.label(text=thing.name, icon="MESH_ICOSPHERE")
            column.prop(thing.tactile, "press_by")
            if thing.tactile.press_by == "FORCE":
                column.prop(thing.tactile, "force", text="Force (N)")
            column.prop(thing.tactile, "friction")
            column.prop(thing.tactile, "tilt")
            _depth(column, context, thing)
            if thing.tactile.spec:
                row = column.row(align=True)
                row.label(text=_shape(thing.tactile.spec))
                row.operator("tactile.use_as_indenter", text="Press with Mesh")
        layout.prop(context.scene.tactile_render, "error", text="Largest Error", placeholder="50um,0.6levels")
        layout.operator(TACTILE_OT_simulate.bl_idname, icon="PHYSICS")
        row = layout.row(align=True)
        row.operator(TACTILE_OT_import_scene.bl_idname, text="Import Scene", icon="IMPORT")
        row.operator(TACTILE_OT_export_scene.bl_idname, text="Export Scene", icon="EXPORT")


def _depth(column: bpy.types.UILayout, context: bpy.types.Context, thing: bpy.types.Object) -> None:
    """Draw how deep an indenter stands in the resting gel on this frame, and the button that puts it there."""
    sensor = properties.of_role(context.scene, "DIGIT") or properties.of_role(context.scene, "BIOTAC")
    row = column.row(align=True)
    if sensor is not None and not missing("msgspec"):
        depth = snap_to_gel.depth_of(thing, sensor, context.evaluated_depsgraph_get())
        if depth is not None:
            row.label(text=f"{1e3 * abs(depth):.2f} mm {'above' if depth < 0 else 'below'} the resting gel")
    row.operator("tactile.snap_to_gel")


CLASSES = (TACTILE_PT_recording, TACTILE_PT_picture, TACTILE_PT_author)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
