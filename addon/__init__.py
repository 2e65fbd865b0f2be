"""Bridges between Blender and ``tactile_core``: what a user sees and clicks, and nothing that computes."""

from __future__ import annotations

from . import (
    add_menu,
    command_line,
    import_recording,
    panels,
    preferences,
    preview,
    properties,
    render_engine,
    render_settings,
    render_setup,
    scene_files,
    simulate,
    translate_recording,
)

# In the order of registration: properties before what uses them.
PARTS = (
    properties,
    render_settings,
    preferences,
    import_recording,
    translate_recording,
    preview,
    render_engine,
    render_setup,
    add_menu,
    simulate,
    scene_files,
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
    except Exception:
        for part in reversed(done):
            part.unregister()
        raise


def unregister() -> None:
    """Called by Blender when the extension is switched off."""
    for part in reversed(PARTS):
        part.unregister()
