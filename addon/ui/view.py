"""The 3D views of the window, set so that what was imported can be seen."""

from __future__ import annotations

import bpy


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
