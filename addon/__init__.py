"""Connect Blender to ``tactile_core``: this package holds what a user sees and clicks, ``tactile_core`` computes."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import bpy

from .objects import digit_body
from .operators import (
    check_llvm,
    import_recording,
    preview,
    render_engine,
    render_setup,
    scene_files,
    set_style,
    simulate,
    snap_to_gel,
    translate_imported,
    view,
)
from .process import command_line
from .settings import kept_files, preferences, properties
from .ui import add_menu, asset_library, panels, workspace

# In the order of registration: properties before what uses them.
PARTS = (
    properties,
    preferences,
    kept_files,
    digit_body,
    asset_library,
    check_llvm,
    import_recording,
    translate_imported,
    set_style,
    preview,
    render_engine,
    render_setup,
    add_menu,
    snap_to_gel,
    simulate,
    scene_files,
    workspace,
    panels,
    view,
    command_line,
)


def register() -> None:
    """Register all parts when Blender switches the extension on; unregister them again if one fails."""
    done = []
    try:
        for part in PARTS:
            done.append(part)
            _register(part)
    except Exception:  # whatever it was, it goes on to Blender
        for part in reversed(done[:-1]):
            _unregister(part)
        raise


def unregister() -> None:
    """Unregister all parts when Blender switches the extension off."""
    for part in reversed(PARTS):
        _unregister(part)


def _register(part: ModuleType) -> None:
    """Register what a module ``part`` lists, then call its own `register`. It may lack that, and each of these lists:

    CLASSES : classes for Blender to register; MENUS : pairs (menu, function that draws an entry in it)
    HANDLERS : pairs (list in ``bpy.app.handlers``, function to add to it)
    POINTERS : (type of data-block, name of its new property, property group)
    """
    for kind in _declared(part, "CLASSES"):
        bpy.utils.register_class(kind)
    for holder, name, group in _declared(part, "POINTERS"):
        setattr(holder, name, bpy.props.PointerProperty(type=group, name=name.replace("_", " ").capitalize()))
    for listed, function in (*_declared(part, "MENUS"), *_declared(part, "HANDLERS")):
        listed.append(function)
    if hasattr(part, "register"):
        part.register()


def _unregister(part: ModuleType) -> None:
    """Take back what `_register` did."""
    if hasattr(part, "unregister"):
        part.unregister()
    for listed, function in (*_declared(part, "MENUS"), *_declared(part, "HANDLERS")):
        listed.remove(function)
    for holder, name, _ in _declared(part, "POINTERS"):
        delattr(holder, name)
    for kind in reversed(_declared(part, "CLASSES")):
        bpy.utils.unregister_class(kind)


def _declared(part: ModuleType, what: str) -> Sequence[Any]:
    return getattr(part, what, ())
