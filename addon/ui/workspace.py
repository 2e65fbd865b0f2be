"""Make the workspace "Tactile": a 3D view of the sensors, the picture, the active object's properties, a timeline."""

from __future__ import annotations

import functools

import bpy

from ..objects import images
from ..operators import view
from ..settings import properties
from ..settings.reports import TactileOperator

NAME = "Tactile"
# Shares of the timeline at the bottom, of what is left of the picture, and of what is below it.
_TIMELINE, _LEFT, _BELOW = 0.14, 0.7, 0.42
_STEP = 0.1  # s between two looks whether Blender has opened the workspace
_LOOKS = 50


class TACTILE_OT_open_workspace(TactileOperator):
    """Open a workspace with the sensors, the gel's picture, properties and a timeline; it is made once per file"""

    bl_idname = "tactile.open_workspace"
    bl_label = "Tactile Workspace"
    bl_options = {"REGISTER"}  # noqa: RUF012 (windows are no part of undo)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true in a window."""
        return context.window is not None and not bpy.app.background

    def _work(self, context: bpy.types.Context) -> None:
        if NAME in bpy.data.workspaces:
            context.window.workspace = bpy.data.workspaces[NAME]
            return
        before = {*bpy.data.workspaces}
        bpy.ops.workspace.duplicate()
        made = ({*bpy.data.workspaces} - before).pop()
        made.name = NAME
        # Blender opens it once this has returned.
        later = functools.partial(_arrange_once_open, context.window_manager, context.window, made, [_LOOKS])
        bpy.app.timers.register(later, first_interval=_STEP)


def _arrange_once_open(
    windows: bpy.types.WindowManager, window: bpy.types.Window, made: bpy.types.WorkSpace, looks: list[int]
) -> float | None:
    """Arrange the new workspace ``made`` once its window shows it. Return the seconds after which Blender's timer is to
    try again, None to stop. looks : [tries left], counted down here"""
    looks[0] -= 1
    if window not in windows.windows[:] or not looks[0]:
        return None
    if window.workspace != made:
        return _STEP
    arrange(window)
    bpy.app.timers.register(functools.partial(_bare_timeline, windows, window), first_interval=view.DRAWN)
    return None


def _bare_timeline(windows: bpy.types.WindowManager, window: bpy.types.Window) -> None:
    """Hide channels and sidebar of a timeline that has been drawn; before that, Blender 4.3 would crash."""
    for area in window.screen.areas if window in windows.windows[:] else ():
        if area.ui_type == "TIMELINE":
            area.spaces.active.show_region_channels = area.spaces.active.show_region_ui = False


def arrange(window: bpy.types.Window) -> None:
    """Rearrange a window's screen: a 3D view, the picture over properties to its right, a timeline below, no more."""
    kept = max(window.screen.areas, key=lambda area: area.width * area.height)
    kept.ui_type = "VIEW_3D"
    for area in [each for each in window.screen.areas if each != kept]:
        with bpy.context.temp_override(window=window, screen=window.screen, area=area):
            bpy.ops.screen.area_close()
    _split(window, kept, "HORIZONTAL", _TIMELINE, "TIMELINE")
    picture = _split(window, kept, "VERTICAL", _LEFT, "IMAGE_EDITOR")
    _split(window, picture, "HORIZONTAL", _BELOW, "PROPERTIES")
    gel = properties.gel_of(window.scene)
    picture.spaces.active.image = None if gel is None else images.image_of(gel, "picture")
    with bpy.context.temp_override(window=window):
        view.open_tab(bpy.context)
        view.look_again(bpy.context)


def _split(window: bpy.types.Window, area: bpy.types.Area, direction: str, share: float, kind: str) -> bpy.types.Area:
    """Split an area; return the smaller part, which becomes an editor of a ``kind``.
    direction : "VERTICAL" or "HORIZONTAL"; share : 0 to 1, where to cut, from the left or lower end"""
    before = {*window.screen.areas}
    with bpy.context.temp_override(window=window, screen=window.screen, area=area):
        bpy.ops.screen.area_split(direction=direction, factor=share)
    made = ({*window.screen.areas} - before).pop()
    made.ui_type = kind
    return made


def _menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.operator(TACTILE_OT_open_workspace.bl_idname, icon="WORKSPACE")


CLASSES = (TACTILE_OT_open_workspace,)
MENUS = ((bpy.types.TOPBAR_MT_window, _menu),)
