"""Preferences > Add-ons > Tactile: what is there, what is missing and what to do."""

import bpy

from .reports import ADVICE, MODULES, missing


class TactilePreferences(bpy.types.AddonPreferences):
    """Shown under the add-on's name."""

    bl_idname = __package__.rsplit(".", 2)[0]  # the extension, not this package in it

    def draw(self, _context: bpy.types.Context) -> None:
        """Called by Blender."""
        column = self.layout.column(align=True)
        column.label(text="Import from CSV and NPZ, translation and the fast picture work", icon="CHECKMARK")
        lacking = set(missing(*MODULES))
        for name, use in MODULES.items():
            there = name not in lacking
            text = f"{name}: {use}" if there else f"{name} is missing: no {use}"
            column.label(text=text, icon="CHECKMARK" if there else "ERROR")
        if lacking:
            column.label(text=ADVICE + ".", icon="INFO")


register, unregister = bpy.utils.register_classes_factory((TactilePreferences,))
