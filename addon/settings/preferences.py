"""Preferences > Add-ons > Tactile: installed and missing libraries, advice; cache, LLVM, default calibration."""

import os
import shutil
from pathlib import Path

import bpy

from ...tactile_core.files import array_cache
from ...tactile_core.sensors import descriptor
from ...tactile_core.sensors.descriptor import OWN
from .reports import ADVICE, MODULES, TactileOperator, missing

ID = __package__.rsplit(".", 2)[0]  # the extension, not this package in it
LLVM_VARIABLE = "DRJIT_LIBLLVM_PATH"  # by which Mitsuba finds the library
_BEFORE = {variable: os.environ.get(variable) for variable in (LLVM_VARIABLE, OWN)}


def addon_preferences(context: bpy.types.Context) -> bpy.types.AddonPreferences | None:
    """Return the extension's preferences; None if the option ``--addons`` has switched it on for one run alone."""
    known = context.preferences.addons.get(ID)
    return None if known is None else known.preferences


class TACTILE_OT_clear_cache(TactileOperator):
    """Remove what was computed once for all simulations and is computed again, in minutes, where it is missing"""

    bl_idname = "tactile.clear_cache"
    bl_label = "Clear Cache"
    bl_options = {"REGISTER"}  # noqa: RUF012 (no part of the file)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask first."""
        return context.window_manager.invoke_confirm(self, event)

    def _work(self, _context: bpy.types.Context) -> None:
        known = array_cache.entries()
        size = sum(map(size_of, known))
        for folder in known:
            shutil.rmtree(folder)
        self.report({"INFO"}, f"{len(known)} folders removed, {1e-6 * size:.0f} MB")


def size_of(folder: Path) -> int:
    """Return how many bytes the files directly in a folder take, subfolders not counted."""
    return sum(file.stat().st_size for file in folder.iterdir() if file.is_file())


def _llvm_changed(preferences: bpy.types.AddonPreferences, _context: bpy.types.Context) -> None:
    preferences.verdict = ""
    _tell(preferences)


def _tell(preferences: bpy.types.AddonPreferences) -> None:
    """Tell this process and its workers the paths of LLVM's library and the user's sensors; an empty one is the one
    that Blender was started with."""
    for variable, path in ((LLVM_VARIABLE, preferences.llvm), (OWN, preferences.sensors)):
        told = bpy.path.abspath(path) or _BEFORE[variable]
        if told:
            os.environ[variable] = told
        else:
            os.environ.pop(variable, None)


def sensors_in(folder: str) -> list[str]:
    """List the known sensors that have a folder of their name in a folder of the user's; none if it cannot be read."""
    known, place = descriptor.names(), Path(bpy.path.abspath(folder))
    try:
        return sorted(each.name for each in place.iterdir() if each.is_dir() and each.name in known)
    except OSError:
        return []


class TactilePreferences(bpy.types.AddonPreferences):
    """Paths of the default calibration, the LLVM library and own sensors; what is installed."""

    bl_idname = ID

    calibration: bpy.props.StringProperty(
        name="Default Calibration", description="File of one DIGIT unit (tactile calibrate) for scenes that name none;"
        " empty: the one that ships", subtype="FILE_PATH",
    )  # fmt: skip
    llvm: bpy.props.StringProperty(
        name="LLVM Library", description="libLLVM.so, LLVM-C.dll or libLLVM.dylib, version 18 or newer, which makes"
        " Mitsuba's presets several times faster; empty: the system's", subtype="FILE_PATH", update=_llvm_changed,
    )  # fmt: skip
    sensors: bpy.props.StringProperty(
        name="Own Sensors", description="Folder with sensors of your own, each a folder with its sensor.toml, and with"
        " tables that do not ship, as a BioTac SP's electrodes", subtype="DIR_PATH", update=lambda self, _: _tell(self),
    )  # fmt: skip
    verdict: bpy.props.StringProperty(name="Verdict", description="What the last check of LLVM has found")

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the preferences; Blender calls it."""
        column = self.layout.column(align=True)
        column.label(text="Import from CSV and NPZ, translation and the fast picture work", icon="CHECKMARK")
        lacking = set(missing(*MODULES))
        for name, use in MODULES.items():
            there = name not in lacking
            text = f"{name}: {use}" if there else f"{name} is missing: no {use}"
            column.label(text=text, icon="CHECKMARK" if there else "ERROR")
        if lacking:
            column.label(text=ADVICE + ".", icon="INFO")
        column = self.layout.column()
        column.use_property_split = True
        column.prop(self, "calibration")
        column.prop(self, "sensors")
        if self.sensors:
            held = sensors_in(self.sensors)
            text = f"Found there: {', '.join(held)}" if held else "No sensor there: choose the folder of their folders"
            column.label(text=text, icon="CHECKMARK" if held else "ERROR")
        column.prop(self, "llvm")
        row = column.row()
        row.label(text=self.verdict or "LLVM: not checked yet", icon="INFO")
        row.operator("tactile.check_llvm", icon="FILE_REFRESH")
        row = column.row()
        size = sum(map(size_of, array_cache.entries()))
        row.label(text=f"Cache: {1e-6 * size:.0f} MB in {array_cache.cache_folder()}", icon="DISK_DRIVE")
        row.operator(TACTILE_OT_clear_cache.bl_idname, icon="TRASH")
        row = column.row()
        row.label(text="Styles in the asset library “Tactile”", icon="ASSET_MANAGER")
        row.operator("tactile.install_styles", icon="FILE_REFRESH")


CLASSES = (TACTILE_OT_clear_cache, TactilePreferences)


def register() -> None:
    """Keep the cache in the extension's folder, and take up what the user set before: LLVM, the folder of sensors."""
    os.environ.setdefault(array_cache.CHOSEN, bpy.utils.extension_path_user(ID, path="cache"))
    stored = bpy.context.preferences.addons.get(ID)
    if stored is not None and stored.preferences is not None:
        _tell(stored.preferences)
