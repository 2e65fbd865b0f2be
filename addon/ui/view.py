"""The window, set so that what was imported can be seen: 3D views, the sidebar's tab, and a place for the picture."""

from __future__ import annotations

import contextlib

import bpy
import numpy as np
from mathutils import Vector

# Of a new file of Blender's (File > New > General): name, type and place.
_UNTOUCHED = (
    ("Cube", "MESH", (0.0, 0.0, 0.0)),
    ("Light", "LIGHT", (4.0762, 1.0055, 5.9039)),
    ("Camera", "CAMERA", (7.3589, -6.9258, 4.9583)),
)
_SHARE = 0.68  # of a 3D view that it keeps beside the picture


def hide_untouched(scene: bpy.types.Scene) -> None:
    """Hide the cube, light and camera that a new file begins with, unless somebody has moved or renamed them.

    A sun takes the light's place, so that a rendered view is not dark: no sun reaches the DIGIT's picture.
    """
    for name, kind, place in _UNTOUCHED:
        thing = scene.objects.get(name)
        if thing is not None and thing.type == kind and np.allclose(thing.location, place, atol=1e-3):
            if kind == "LIGHT" and not thing.hide_render:
                _add_sun(thing)
            thing.hide_render, thing.hide_viewport = True, True


def _add_sun(light: bpy.types.Object) -> None:
    sun = bpy.data.objects.new("Tactile sun", bpy.data.lights.new("Tactile sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (0.6, 0.35, 0.0)  # W/m2; from above, the base and one side
    sun.tactile.role = "LEGEND"
    light.users_collection[0].objects.link(sun)


def is_new(scene: bpy.types.Scene) -> bool:
    """Return true for a scene that holds nothing of the user's own: its units and frame rate may be set."""
    return all(thing.hide_viewport or thing.tactile.role != "NONE" for thing in scene.objects)


def show_picture(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image in the window's Image Editor, which is made beside the largest 3D view where there is none."""
    screen = context.window.screen if context.window else None
    if screen is None:
        return
    editor = next((area for area in screen.areas if area.type == "IMAGE_EDITOR"), None)
    views = [area for area in screen.areas if area.type == "VIEW_3D"]
    if editor is None and views and not bpy.app.background:
        view, before = max(views, key=lambda area: area.width * area.height), set(screen.areas)
        with context.temp_override(window=context.window, area=view):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=_SHARE)
        editor = next((area for area in screen.areas if area not in before), None)
        if editor is not None:
            editor.type = "IMAGE_EDITOR"
    if editor is not None:
        editor.spaces.active.image = image


def open_tab(context: bpy.types.Context) -> None:
    """Open the sidebar with the tab "Tactile" in each 3D view; older Blenders open the sidebar alone."""
    for area in context.window.screen.areas if context.window else ():
        if area.type == "VIEW_3D":
            area.spaces.active.show_region_ui = True
            for region in area.regions:
                if region.type == "UI":
                    with contextlib.suppress(AttributeError, TypeError):
                        region.active_panel_category = "Tactile"


def show(context: bpy.types.Context, things: list[bpy.types.Object]) -> None:
    """Select the things, colour solid views by object, and look at them. Without a window, select only."""
    for thing in context.view_layer.objects:
        thing.select_set(thing in things)
    context.view_layer.objects.active = things[0]
    window = context.window
    for area in window.screen.areas if window else ():
        if area.type != "VIEW_3D":
            continue
        area.spaces.active.shading.color_type = "OBJECT"
        region = next((region for region in area.regions if region.type == "WINDOW"), None)
        if region is not None:
            with context.temp_override(window=window, area=area, region=region):
                bpy.ops.view3d.view_selected()
            _clear_sidebar(area, region)


def _clear_sidebar(area: bpy.types.Area, region: bpy.types.Region) -> None:
    """Move what is looked at into the part of a view that its sidebar, drawn over it, leaves free."""
    sidebar = next((each for each in area.regions if each.type == "UI"), None)
    if sidebar is None or not 1 < sidebar.width < region.width:
        return
    seen, free = area.spaces.active.region_3d, 1 - sidebar.width / region.width
    right = seen.view_rotation @ Vector((1.0, 0.0, 0.0))
    seen.view_distance /= free
    # Width that the view shows at what it looks at: Blender's lens is for a sensor of 72 mm along the longer side.
    wide = seen.view_distance * 72 / area.spaces.active.lens * region.width / max(region.width, region.height)
    seen.view_location += right * wide * (1 - free) / 2


def colour_by(context: bpy.types.Context, kind: str) -> None:
    """Colour Solid views by object, or by the surfaces' own colours where they have some ("VERTEX")."""
    for area in context.window.screen.areas if context.window else ():
        if area.type == "VIEW_3D":
            area.spaces.active.shading.color_type = kind
