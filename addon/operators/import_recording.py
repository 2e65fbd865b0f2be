"""Import recordings by File > Import > BioTac Recording or by drag and drop; of other sensors with their weights."""

import functools
import os
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.io_utils import ImportHelper

from ...tactile_core import sensors
from ...tactile_core.errors import TactileError
from ...tactile_core.recordings.info import unit_rows
from ...tactile_core.recordings.opened_file import ENDINGS
from ...tactile_core.recordings.recording import short_of
from ...tactile_core.sensors.electrodes import table_of
from ..objects import axes, biotac_objects, curves, electrode_markers
from ..settings import kept_files, properties
from ..settings.properties import MOTIONS, RecordingOptions
from ..settings.reports import Refused, TactileOperator, in_blender, reported, shown
from . import recording_data, set_style, view

_APART = 85e-3  # m between the recordings of a scene: a BioTac, a DIGIT's housing and a gap
_LABEL = "BioTac Recording (.csv, .h5, .npz, .mat, .json, .bag, .mcap)"


def _fingers(operator: bpy.types.Operator, context: bpy.types.Context) -> list[tuple[str, str, str]]:
    """List the recordings of a file as a menu's items: the operator's file, or the one selected in an open browser."""
    path, chosen = bpy.path.abspath(operator.filepath), getattr(context.space_data, "params", None)
    if not os.path.isfile(path) and hasattr(chosen, "filename"):
        path = os.path.join(os.fsdecode(chosen.directory), chosen.filename)
    return _items(tuple(recording_data.fingers(path)))


@functools.lru_cache(maxsize=8)  # Blender needs the texts to live on
def _items(names: tuple[str, ...]) -> list[tuple[str, str, str]]:
    return [
        (str(k), name.rpartition("#")[2] if "#" in name else "The file's own", name) for k, name in enumerate(names)
    ]


class TACTILE_OT_import_recording(RecordingOptions, TactileOperator, ImportHelper):
    """Import a recording of a BioTac or a BioTac SP as an animated skin with its core and electrodes"""

    bl_idname = "tactile.import_recording"
    bl_label = "Import BioTac Recording"
    bl_options = {"REGISTER", "UNDO", "PRESET"}  # noqa: RUF012

    filepath: bpy.props.StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"})
    directory: bpy.props.StringProperty(name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: bpy.props.CollectionProperty(
        name="Files", description="Recordings of the folder; several stand side by side",
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"},
    )  # fmt: skip
    filename_ext = ".csv"
    filter_glob: bpy.props.StringProperty(default=";".join(f"*{end}" for end in ENDINGS), options={"HIDDEN"})
    finger: bpy.props.EnumProperty(
        name="Finger", description="Which of the recordings of a file of several fingers or topics",
        items=lambda self, context: _fingers(self, context), options={"SKIP_SAVE"},
    )  # fmt: skip
    first_frame: bpy.props.IntProperty(
        name="First Frame", description="Scene frame on which the recording's frame 0 is put", default=0
    )
    motion: bpy.props.EnumProperty(
        name="Animation", description="How the movement of skin and gel is stored", default="AUTOMATIC",
        items=(("AUTOMATIC", "Automatic", f"Shape keys; a mesh cache beyond {recording_data.LONG} frames", "", 3),
               *MOTIONS),
    )  # fmt: skip
    millimetres: bpy.props.BoolProperty(
        name="Scene in Millimetres",
        description="Set the scene's unit to 1 mm, so that a fingertip is workable. A scene that holds anything else"
        " keeps its own unit, unless you choose this anew",
        default=True, options={"SKIP_SAVE"},  # what is set was chosen for this import
    )  # fmt: skip
    set_timeline: bpy.props.BoolProperty(
        name="Set Frame Rate and Range", description="Let the scene play the recording in its own time; one that holds"
        " anything else keeps its own, unless you choose this anew", default=True, options={"SKIP_SAVE"},
    )  # fmt: skip

    def _work(self, context: bpy.types.Context) -> None:
        """Import the files. A bad one is reported and the others are imported; raise Refused if all are bad."""
        done, paths, timed = 0, self._paths(), False
        for path in paths:
            try:
                with reported(self):
                    last = self._import(context, path)
            except Refused:
                continue
            done, timed = done + 1, timed or self.set_timeline
            if timed:  # as long as the longest of them
                context.scene.frame_end = max(context.scene.frame_end, last)
        if not done:
            raise Refused(self.filepath)

    def _paths(self) -> list[str]:
        """List the files that were chosen or dropped."""
        folder, names = bpy.path.abspath(self.directory), [each.name for each in self.files if each.name]
        return [os.path.join(folder, name) for name in names] or [bpy.path.abspath(self.filepath)]

    def _import(self, context: bpy.types.Context, path: str) -> int:
        """Import one recording; return the scene's frame of its last. Raises TactileError for one that cannot be."""
        held = [path] if self.columns else recording_data.fingers(path)  # a map names one finger's columns
        finger = int(self.finger or 0)
        if finger >= len(held):
            raise TactileError(path, f"{len(held)} recordings", f"a finger {finger}", "Import it by itself")
        path = held[finger]
        if len(held) > 1 and not self.properties.is_property_set("finger"):
            self.report({"WARNING"}, f"{short_of(path)} is one of {len(held)} recordings; Finger picks another")
        guessed = recording_data.write_columns(path, self)
        if guessed:
            self.report({"WARNING"}, guessed)
        scene, motion = context.scene, "" if self.motion == "AUTOMATIC" else self.motion
        per_metre = 1000.0 if self._in_millimetres(scene) else axes.units_per_metre(scene)
        with shown(context) as progress:
            found = recording_data.load(path, self, progress, motion, per_metre)
        source = found.translator.source
        placed = table_of(source).is_file()
        if placed:
            sensors.electrodes(source)  # a bad table is refused before anything is made
        view.hide_untouched(scene)
        kept = self._keep_scene(scene, found.recording.rate)
        frames = self.first_frame + found.chosen.astype(float)
        skin = self._skin(scene, path, found)
        skin.tactile.motion = "SHAPE_KEYS" if found.skin.file is None else recording_data.MESH_CACHE
        summary = play(skin, found, frames)
        if self.set_timeline:
            view.set_timeline(scene, found.recording.rate, int(frames[0]), int(frames[-1]))
            firmest = np.linalg.norm(found.translation.force, axis=1).argmax()
            scene.frame_set(int(frames[firmest]))
            view.fit_timeline(context)
        if frames[0] < 0:
            words = f"Frames {frames[0]:g} to {min(frames[-1], -1):g} are not rendered: Blender's range begins at 0"
            self.report({"WARNING"}, f"{words}. Choose a later First Frame")
        view.open_tab(context)
        there = [thing for thing in scene.objects if thing.tactile.role in ("BIOTAC", "DIGIT") and thing != skin]
        view.show(context, [skin], there)
        if not placed:
            advice = "Name the folder of your own sensors in Preferences"
            self.report({"WARNING"}, f"No electrodes are shown: there is no {table_of(source)}. {advice}")
        name = f"{os.path.basename(path)}: " if len(self.files) > 1 else ""
        for warning in found.signals.warnings:
            self.report({"WARNING"}, name + in_blender(warning))
        self.report({"INFO"}, f"{name}{len(frames)} frames at {found.recording.rate:.4g} Hz. {summary}{kept}")
        return int(frames[-1])

    def _keep_scene(self, scene: bpy.types.Scene, rate: float) -> str:
        """Set the scene's units, but keep those and the frame rate of a scene that is not empty, unless the user chose
        to set them. Return words on what was kept, to end a sentence. rate : of the recording, Hz"""
        if self._in_millimetres(scene):
            view.use_millimetres(self, scene)
        if view.is_new(scene) and properties.of_role(scene, "BIOTAC") is None:
            return ""
        if not self.properties.is_property_set("set_timeline"):
            self.set_timeline = False
        if self.set_timeline:
            return ""
        speed = scene.render.fps / scene.render.fps_base / rate
        return f". The scene's own frame rate and range are kept: it plays {speed:.3g} times as fast as recorded"

    def _in_millimetres(self, scene: bpy.types.Scene) -> bool:
        return self.millimetres and (view.is_new(scene) or self.properties.is_property_set("millimetres"))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Open a small popup for a file that was dropped; else, from the menu, open the file browser."""
        if not self.filepath and not self.files:
            return super().invoke(context, event)
        several = len(self.files) > 1
        title = f"{len(self.files)} recordings" if several else os.path.basename(self.filepath or self.files[0].name)
        asked = {"title": title, "confirm_text": "Import", "translate": False}
        return context.window_manager.invoke_props_dialog(self, **asked)

    def _skin(self, scene: bpy.types.Scene, path: str, found: recording_data.Translated) -> bpy.types.Object:
        group = biotac_objects.new_collection(scene, found.recording.name)
        before = [thing for thing in scene.objects if thing.tactile.role == "BIOTAC"]
        skin = biotac_objects.add_skin(group, axes.units_per_metre(scene), found.translator.source)
        if before:  # beside the last pair of sensors
            skin.location = before[-1].location
            skin.location.y -= _APART * skin.tactile.per_metre
        about = skin.tactile
        about.recording = kept_files.shown(Path(os.path.abspath(path)))
        for name in RecordingOptions.__annotations__:
            setattr(about, name, getattr(self, name))
        about.first_frame = self.first_frame
        biotac_objects.add_core(group, skin)
        return skin


def play(skin: bpy.types.Object, found: recording_data.Translated, frames: np.ndarray) -> str:
    """Animate a skin and its electrodes by ``found`` at frames (T,) of the scene; return a sentence on how."""
    rows = unit_rows(found.signals) or [("unit", "nothing is known of it by this recording")]
    skin.tactile.known = "\n".join(f"{label}: {words}" for label, words in rows)
    if table_of(properties.sensor_name(skin)).is_file():
        electrode_markers.add_markers(skin, found.signals.change, frames)
        electrode_markers.add_counts(skin, found.signals.change, frames)
    return set_style.animate(skin, found.skin, frames, skin.tactile.motion, found.columns())


def plays(skin: bpy.types.Object, found: recording_data.Translated, frames: np.ndarray) -> bool:
    """Return true if a skin has the signals and forces of ``found`` at frames (T,) of the scene; false if its unit or
    tare has been changed, or if its keys have been shifted."""
    values, keys = found.columns(), skin.data.shape_keys
    own = [keys] if keys and skin.tactile.motion != "MESH_CACHE" else []
    timed = [curves.points_of(skin, '["force"]'), *(curves.points_of(each, "eval_time") for each in own)]
    if not all(np.array_equal(points[:, 0], frames.astype(np.float32)) for points in timed):
        return False
    shown = {name: values[name].astype(np.float32).T for name in ("electrodes", "force")}
    return all(np.array_equal(curves.values_of(skin, f'["{name}"]', k), row) for name, rows in shown.items()
               for k, row in enumerate(rows))  # fmt: skip


class TACTILE_FH_recording(bpy.types.FileHandler):
    """Recordings dropped on a 3D view"""

    bl_idname = "TACTILE_FH_recording"
    bl_label = "BioTac recording"
    bl_import_operator = "tactile.import_recording"
    bl_file_extensions = ";".join(ENDINGS)

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Return true on 3D views only."""
        return context.area is not None and context.area.type == "VIEW_3D"


def _menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator(TACTILE_OT_import_recording.bl_idname, text=_LABEL)


CLASSES = (TACTILE_OT_import_recording, TACTILE_FH_recording)
MENUS = ((bpy.types.TOPBAR_MT_file_import, _menu),)
