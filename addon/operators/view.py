"""Set the window to show what was imported: 3D views, sidebar's tab, place for the picture; and the scene's time."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Vector

from ...tactile_core.translation.trust_words import LOW_CONFIDENCE
from ..objects import axes
from ..settings import properties

# Of a new file of Blender's (File > New > General): name, type and place.
_UNTOUCHED = (
    ("Cube", "MESH", (0.0, 0.0, 0.0)),
    ("Light", "LIGHT", (4.0762, 1.0055, 5.9039)),
    ("Camera", "CAMERA", (7.3589, -6.9258, 4.9583)),
)
_SHARE = 0.68  # of a 3D view that it keeps beside the picture
DRAWN = 0.2  # s, until a split view is drawn in its new size
_FIRST = 2.0  # s, until a sidebar is drawn, of a busy machine too
TAB = "Tactile"
MARKER = "low confidence"
MOST_MARKERS = 100  # more would hide the timeline
_MARGIN = 1.1  # of a view, around what is looked at


def hide_untouched(scene: bpy.types.Scene) -> None:
    """Hide the cube, light and camera that a new file begins with, unless somebody has moved or renamed them.

    A sun takes the light's place, so that a rendered view is not dark: no sun reaches the DIGIT's picture.
    """
    for thing in _untouched(scene):
        if thing.type == "LIGHT" and not thing.hide_render:
            _add_sun(thing)
        thing.hide_render, thing.hide_viewport = True, True


def _untouched(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    named = [(scene.objects.get(name), kind, place) for name, kind, place in _UNTOUCHED]
    return [thing for thing, kind, place in named
            if thing is not None and thing.type == kind and np.allclose(thing.location, place, atol=1e-3)]  # fmt: skip


def _add_sun(light: bpy.types.Object) -> None:
    sun = bpy.data.objects.new("Tactile sun", bpy.data.lights.new("Tactile sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (0.6, 0.35, 0.0)  # W/m2; from above, the base and one side
    sun.tactile.role = "LEGEND"
    properties.home_of(light).objects.link(sun)


def is_new(scene: bpy.types.Scene) -> bool:
    """Return true if a scene holds nothing of the user's own, so that its units and frame rate may be set."""
    known = _untouched(scene)
    return all(thing.hide_viewport or thing.tactile.role != "NONE" or thing in known for thing in scene.objects)


def use_millimetres(operator: bpy.types.Operator, scene: bpy.types.Scene) -> None:
    """Make a scene's unit a millimetre. The operator says so if the scene holds anything else, whose sizes change."""
    if not is_new(scene) and not np.isclose(scene.unit_settings.scale_length, 1e-3):
        words = "The scene's unit is a millimetre now, of its other objects too: what was 2 m long is 2 mm"
        advice = "Use a scene for each, or import a recording with Scene in Millimetres off"
        operator.report({"WARNING"}, f"{words}. {advice}")
    axes.use_millimetres(scene)


def show_picture(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image in the window's Image Editor; if there is none, split one off the largest 3D view."""
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
            look_again(context)
    if editor is not None and editor.spaces.active.image != image:
        editor.spaces.active.image = image
        look_again(context, pictures_alone=True)


def look_again(context: bpy.types.Context, pictures_alone: bool = False) -> None:
    """Frame pictures and, unless ``pictures_alone``, the selection a moment later, when views have their size."""
    look = functools.partial(_look_at_selected, context.window_manager, context.window, pictures_alone)
    bpy.app.timers.register(look, first_interval=DRAWN)


def _look_at_selected(windows: bpy.types.WindowManager, window: bpy.types.Window, pictures_alone: bool) -> None:
    """Frame pictures and, unless ``pictures_alone``, selected objects with their parents, as an indenter's sensor."""
    if window not in windows.windows[:]:
        return
    selected = [] if pictures_alone else bpy.context.selected_objects
    with bpy.context.temp_override(window=window):
        if selected:
            look_at(bpy.context, [*selected, *(thing.parent for thing in selected if thing.parent is not None)])
        for area, region in _main_regions(bpy.context, "IMAGE_EDITOR"):
            with bpy.context.temp_override(area=area, region=region):
                bpy.ops.image.view_all(fit_view=True)


def open_tab(context: bpy.types.Context) -> None:
    """Open the sidebar with the tab "Tactile" in each 3D view.

    Older Blenders let no script choose a tab. There, this tab is made the first, on which a new sidebar opens.
    """
    for area, _ in _main_regions(context, "VIEW_3D"):
        area.spaces.active.show_region_ui = True
        for region in (region for region in area.regions if region.type == "UI"):
            try:
                region.active_panel_category = TAB
            except (AttributeError, TypeError):
                _stand_first()


class TACTILE_PT_first(bpy.types.Panel):
    """Puts its tab before all others: those of panels without a header come first"""

    bl_idname, bl_label = "TACTILE_PT_first", ""
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", TAB
    bl_options = {"HIDE_HEADER"}  # noqa: RUF012 (Blender reads plain class attributes)

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw nothing; Blender calls it."""


def _stand_first() -> None:
    """Put the tab "Tactile" before all others until the sidebar is drawn."""
    if not TACTILE_PT_first.is_registered:
        bpy.utils.register_class(TACTILE_PT_first)
        bpy.app.timers.register(_stand_back, first_interval=_FIRST, persistent=True)


def _stand_back() -> None:
    """Let the tab stand behind Blender's own again."""
    if TACTILE_PT_first.is_registered:
        bpy.utils.unregister_class(TACTILE_PT_first)


def unregister() -> None:
    """Remove the panel that `open_tab` adds in older Blenders, when Blender switches the extension off."""
    if bpy.app.timers.is_registered(_stand_back):
        bpy.app.timers.unregister(_stand_back)
    _stand_back()


def fit_timeline(context: bpy.types.Context) -> None:
    """Show the scene's whole frame range in each timeline."""
    for area, region in _main_regions(context, "DOPESHEET_EDITOR"):
        with context.temp_override(window=context.window, area=area, region=region):
            bpy.ops.action.view_all()


def show(context: bpy.types.Context, things: list[bpy.types.Object], beside: Sequence[bpy.types.Object] = ()) -> None:
    """Select `things`, make the first active, colour Solid views by object, and frame things, their parts and `beside`.

    Views that show a style's colours keep them. Without a window, things are only selected.
    """
    for thing in context.view_layer.objects:
        thing.select_set(thing in things)
    with contextlib.suppress(RuntimeError):  # an object of an excluded collection cannot be active
        context.view_layer.objects.active = things[0]
    for area, _ in _main_regions(context, "VIEW_3D"):
        if area.spaces.active.shading.color_type != "VERTEX":
            area.spaces.active.shading.color_type = "OBJECT"
    look_at(context, [*things, *beside])


def _main_regions(context: bpy.types.Context, kind: str) -> list[tuple[bpy.types.Area, bpy.types.Region]]:
    """List the window's areas of a kind, with the region that shows their content; none without a window."""
    areas = context.window.screen.areas if context.window else ()
    return [(a, region) for a in areas if a.type == kind for region in a.regions if region.type == "WINDOW"]


def look_at(context: bpy.types.Context, things: Sequence[bpy.types.Object]) -> None:
    """Centre each 3D view on the objects and their parts, in the area beside toolbar and sidebar; turns no view."""
    context.view_layer.update()
    shown = {part for thing in things for part in (thing, *thing.children) if part.type == "MESH"}
    corners = np.array([part.matrix_world @ Vector(corner) for part in shown for corner in part.bound_box])
    for area, region in _main_regions(context, "VIEW_3D"):
        tools, sidebar = (max((r.width for r in area.regions if r.type == kind), default=0) for kind in ("TOOLS", "UI"))
        if region.width <= tools + sidebar + 1:
            continue
        free = region.width - tools - sidebar
        seen, longest = area.spaces.active.region_3d, max(region.width, region.height)
        right, up, toward = np.array(seen.view_rotation.to_matrix()).T
        sides = np.stack([corners @ right, corners @ up, corners @ toward])  # (3, n)
        middle = (sides.min(axis=1) + sides.max(axis=1)) / 2
        sides -= middle[:, None]
        # Half of what a view shows, a unit of distance: Blender's lens is for a sensor of 72 mm along the longer side.
        half = 36 / area.spaces.active.lens / longest * np.array([free, region.height])
        seen.view_distance = float((sides[2] + _MARGIN * (np.abs(sides[:2]) / half[:, None]).max(axis=0)).max())
        # the view's middle is right of the free part's
        beyond = seen.view_distance * half[0] * (sidebar - tools) / free
        seen.view_location = np.array([right, up, toward]).T @ (middle + np.array([beyond, 0.0, 0.0]))


def colour_by(context: bpy.types.Context, kind: str) -> None:
    """Let Solid views colour by object (``kind`` "OBJECT"), or by a surface's style if it has one ("VERTEX")."""
    for area, _ in _main_regions(context, "VIEW_3D"):
        area.spaces.active.shading.color_type = kind


def set_timeline(scene: bpy.types.Scene, rate: float, first: int, last: int) -> None:
    """Set a scene's frame rate and range to play a recording of ``rate`` Hz in real time from ``first`` to ``last``."""
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    scene.render.frame_map_old = scene.render.frame_map_new = 100
    scene.frame_start, scene.frame_end = first, last
    scene.frame_set(first)


def mark_low_confidence(scene: bpy.types.Scene, name: str, confidence: np.ndarray, frames: np.ndarray) -> int:
    """Mark stretches of frames (T,) whose confidence (T,), 0 to 1, is below 0.5, in place of earlier such marks of the
    skin ``name``, and of an older file's, which name none; return how many stretches there are."""
    name = name.encode()[:30].decode(errors="ignore")  # of 63 bytes that a marker's name may have
    for marker in [each for each in scene.timeline_markers if each.name.startswith((MARKER, f"{name}: {MARKER}"))]:
        scene.timeline_markers.remove(marker)
    edges = np.diff(np.concatenate([[0], confidence < LOW_CONFIDENCE, [0]]).astype(int))
    parts = list(zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0) - 1, strict=True))
    for start, end in parts[:MOST_MARKERS]:
        scene.timeline_markers.new(f"{name}: {MARKER} to {frames[end]:g}", frame=int(frames[start]))
    return len(parts)
