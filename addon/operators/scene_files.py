"""Import Scene and Export Scene: ``scene.toml`` to objects and back."""

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...tactile_core import sensors
from ...tactile_core.errors import TactileError
from ...tactile_core.pictures.height_map import height_map
from ..objects import axes, biotac_objects, curves, digit_body, digit_objects, indenter_objects
from ..process import tracer_process
from ..process.jobs import Job, JobFolder
from ..settings import properties, render_settings
from ..settings.reports import TactileOperator, require
from . import pictures, scene_bridge, view

_HOVER = 12e-3  # m above the sensors' frame: an indenter that presses by force is shown clear of the gel


class TACTILE_OT_import_scene(TactileOperator, ImportHelper):
    """Open a scene.toml: both sensors, its indenters, and its motion as keyframes"""

    bl_idname = "tactile.import_scene"
    bl_label = "Import Tactile Scene"

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def _work(self, context: bpy.types.Context) -> None:
        require("msgspec")
        from ...tactile_core.simulation.scene import load_scene

        path = bpy.path.abspath(self.filepath)
        found = load_scene(path)[0]
        if any(hasattr(spec, "file") for spec in found.indenters):
            require("trimesh", "rtree", "scipy")
        scene = context.scene
        properties.check_absent(scene, *sensors.PAIR)
        view.hide_untouched(scene)
        view.use_millimetres(self, scene)
        group = biotac_objects.new_collection(scene, found.name)
        skin = biotac_objects.add_skin(group, axes.units_per_metre(scene))
        biotac_objects.add_core(group, skin)
        gel = digit_objects.add_gel(group, skin.tactile.per_metre, skin)
        digit_body.add_body(gel, render_settings.calibration_of(scene, properties.sensor_name(gel)))
        things = [indenter_objects.add_indenter(group, spec, skin.tactile.per_metre) for spec in found.indenters]
        for thing in things:
            thing.parent, thing.location.z = gel, _HOVER * skin.tactile.per_metre
        chosen = _set_motion(scene, found, things)
        view.show(context, [chosen, skin, gel])
        self.report({"INFO"}, f"{found.name}: {found.description}")


def _set_motion(scene: bpy.types.Scene, found, things: list[bpy.types.Object]) -> bpy.types.Object:  # noqa: ANN001
    """Keyframe the indenter of the recording that the scene file ``found`` describes, one of ``things``; return it, or
    the first if there is no recording."""
    import msgspec

    document = msgspec.to_builtins(found)
    document["order"] = [spec["name"] for spec in document.pop("indenters")]
    spec = found.recording
    chosen = things[0] if spec is None else things[document["order"].index(spec.indenter)]
    for thing in things:
        thing.tactile.press_by = "FORCE"
    chosen.tactile.document = json.dumps(document)
    if spec is None:
        return chosen
    chosen.tactile.friction, chosen.tactile.tilt = spec.friction, math.radians(spec.tilt_deg)
    points = np.array([[p.time_s, p.x_mm, p.z_mm, p.force_n] for p in spec.points])
    rate = sensors.SAMPLE_RATE
    # A motion may begin later than 0 s: frame 0 stays time 0.
    view.set_timeline(scene, rate, 0, int(np.ceil(points[-1, 0] * rate - 1e-9)))
    frames = points[:, 0] * rate
    per_mm = chosen.tactile.per_metre * 1e-3
    curves.write_curve(chosen, "location", frames, points[:, 1] * per_mm, index=0)
    curves.write_curve(chosen, "location", frames, points[:, 2] * per_mm, index=1)
    curves.write_curve(chosen, "tactile.force", frames, points[:, 3])
    scene.frame_set(scene.frame_start)
    return chosen


class TACTILE_OT_export_scene(TactileOperator, ExportHelper):
    """Write the indenters and their motion as a folder with scene.toml, for `tactile simulate`"""

    bl_idname = "tactile.export_scene"
    bl_label = "Export Tactile Scene"
    bl_options = {"REGISTER"}  # noqa: RUF012 (changes no scene)

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Offer the name that `tactile simulate FOLDER` looks for."""
        self.filepath = "//scene.toml" if bpy.data.is_saved else "scene.toml"
        return super().invoke(context, event)

    def _work(self, context: bpy.types.Context) -> None:
        require("msgspec")
        from ...tactile_core.simulation.scene import write_scene

        path = Path(bpy.path.abspath(self.filepath))
        if path.name != "scene.toml":
            raise TactileError(path, "another file name", "scene.toml", "Name a folder for each scene")
        thing = scene_bridge.indenter_of(context)
        if thing.tactile.press_by == "HEIGHT" and not _has_force(thing):
            advice = "Simulate first, or press by force"
            raise TactileError(thing.name, "no forces yet", "what a scene file holds of a press", advice)
        found = scene_bridge.authored(context)
        pressed = thing.get(scene_bridge.PRESSED)
        if found.apexes is not None and not _same_path(found.apexes, context.scene.frame_start, pressed):
            lacking = "moved since its forces were found, or they end before"
            raise TactileError(thing.name, lacking, "forces of this motion", "Simulate again, or press by force")
        write_scene(path.parent, found.scene, found.meshes)
        self.report({"INFO"}, f"{path}: {len(found.scene.recording.points)} points")


class TACTILE_OT_export_mitsuba(TactileOperator, ExportHelper):
    """Write the gel as a scene for any Mitsuba 3: .xml, .ply, and .camera.exr, which turns radiance into levels"""

    bl_idname = "tactile.export_mitsuba"
    bl_label = "Export Mitsuba Scene"
    bl_options = {"REGISTER"}  # noqa: RUF012 (changes no scene)

    filename_ext = ".xml"
    filter_glob: bpy.props.StringProperty(default="*.xml", options={"HIDDEN"})

    def _work(self, context: bpy.types.Context) -> None:
        require("OpenEXR")
        gel = properties.needed_gel(context.scene, context.object)
        shown, moved = pictures.shown_state(gel, context.evaluated_depsgraph_get())
        path = os.path.abspath(bpy.path.abspath(self.filepath))
        others = (Path(path).with_suffix(end) for end in (".ply", ".camera.exr"))  # of which no browser asks
        other = None if os.path.exists(path) else next((file for file in others if file.exists()), None)
        if other is not None:
            raise TactileError(other, "already there, of no scene of this name", "a new file", "Choose another name")
        with JobFolder() as folder:
            tracer_process.write_unit(folder, shown.unit)
            np.save(folder / "heights.npy", height_map(moved, shown.unit.camera))
            Job("picture_scene", folder, path=path).wait()
        self.report({"INFO"}, path + "; other lamps and bodies are left out" * bool(shown.around))


def _same_path(apexes: np.ndarray, start: int, pressed: Sequence[float] | None) -> bool:
    """Return true if an indenter's path is in the one that its forces were found for, or if that is not known.
    apexes : (P, 3) m, the path from frame ``start`` on; pressed : as ``PRESSED``, None in an older file"""
    if pressed is None:
        return True
    skipped = start - int(pressed[0])
    same = np.reshape(pressed[1:], (-1, 3))[max(skipped, 0) :][: len(apexes)]
    return skipped >= 0 and len(same) == len(apexes) and np.allclose(same, apexes, atol=1e-6)


def _has_force(thing: bpy.types.Object) -> bool:
    animation = thing.animation_data
    if animation is None or animation.action is None:
        return False
    return curves.fcurves_of(thing).find("tactile.force") is not None


def _menu_import(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator(TACTILE_OT_import_scene.bl_idname, text="Tactile Scene (scene.toml)")


def _menu_export(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator(TACTILE_OT_export_scene.bl_idname, text="Tactile Scene (scene.toml)")
    menu.layout.operator(TACTILE_OT_export_mitsuba.bl_idname, text="Tactile Picture's Scene (Mitsuba .xml)")


CLASSES = (TACTILE_OT_import_scene, TACTILE_OT_export_scene, TACTILE_OT_export_mitsuba)
MENUS = ((bpy.types.TOPBAR_MT_file_import, _menu_import), (bpy.types.TOPBAR_MT_file_export, _menu_export))
