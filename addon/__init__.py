"""Bridges between Blender and ``tactile_core``: what a user sees and clicks, and nothing that computes."""

from __future__ import annotations

from .operators import (
    calibration_objects,
    check_llvm,
    import_recording,
    preview,
    render_engine,
    render_setup,
    scene_files,
    set_style,
    simulate,
    snap_to_gel,
    stale_picture,
    translate_imported,
)
from .process import command_line
from .ui import add_menu, asset_library, panels, preferences, properties, render_settings, workspace

# In the order of registration: properties before what uses them.
PARTS = (
    properties,
    render_settings,
    preferences,
    asset_library,
    check_llvm,
    import_recording,
    translate_imported,
    set_style,
    preview,
    stale_picture,
    render_engine,
    render_setup,
    calibration_objects,
    add_menu,
    snap_to_gel,
    simulate,
    scene_files,
    workspace,
    panels,
    command_line,
)


def register() -> None:
    """Called by Blender when the extension is switched on; what was registered is taken back if a part fails."""
    done = []
    try:
        for part in PARTS:
            part.register()
            done.append(part)
    except Exception:  # whatever it was, it goes on to Blender
        for part in reversed(done):
            part.unregister()
        raise


def unregister() -> None:
    """Called by Blender when the extension is switched off."""
    for part in reversed(PARTS):
        part.unregister()
