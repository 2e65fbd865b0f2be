"""Draw a gel's picture as the scene has it now: with its dent, LEDs, coating and camera."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.pictures import height_map, seen_fields
from ...tactile_core.pictures.renderer import Renderer
from ...tactile_core.sensors.calibration import Calibration
from ...tactile_core.translation import gel_place
from ..objects import axes, digit_objects, digit_unit, images
from ..process import tracer_process
from ..settings import properties, render_settings, reports
from . import view

FAST = "fast"
_STILL = 1e-7  # m, of displacements that are read back from float32 coordinates
_RENDERERS = 4  # kept at most: the frames of an animation share them
_drawn: dict[str, tuple[str, np.ndarray, str]] = {}  # what an image shows: the gel's name, its displacement, its unit
_renderers: dict[str, Renderer] = {}


def renderer_of(unit: Calibration) -> Renderer:
    """Return the fast renderer of a unit."""
    key = repr(unit)  # a calibration holds tables, which have no hash
    if key not in _renderers:
        if len(_renderers) == _RENDERERS:
            _renderers.clear()
        _renderers[key] = Renderer(unit, FAST)
    return _renderers[key]


def draw(
    gel: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    preset: str,
    size: tuple[int, int] | None = None,
    stopped: Callable[[], bool] = lambda: False,
    better: Callable[[np.ndarray], None] = lambda picture: None,
    warn: Callable[[str], None] = lambda words: None,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw a gel's picture by a preset; return it, (H, W, 3) uint8, and the gel's heights (H, W) m.

    size : (width, height) px, None for the calibration's
    stopped : called again and again; once it returns true, ``tracer_process.Stopped`` is raised
    better : called with pictures that come before the returned one and are less exact
    warn : called with a sentence on bodies that reach into the housing and that the fast preset leaves out
    Raises TactileError if no picture can be drawn.
    """
    shown, moved = shown_state(gel, depsgraph, size)
    if preset == FAST and shown.around.occluders:
        warn(f"Meshes that reach into {gel.name}'s housing: {len(shown.around.occluders)}, left out by the preset fast")
    return _drawn_of(shown, moved, preset, stopped, better)


def shown_state(
    gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, size: tuple[int, int] | None = None
) -> tuple[digit_unit.ShownUnit, np.ndarray]:
    """Return the unit that the scene shows, for a picture of the ``size``, and the gel's displacement (n, 3) m.
    size : (width, height) px, None for the calibration's"""
    moved = digit_objects.displacement_of(gel, depsgraph)  # first: it says what else would be a wrong camera
    unit = render_settings.calibration_of(depsgraph.scene, properties.sensor_name(gel), size)
    return digit_unit.shown_unit(gel, depsgraph, unit), moved


def _drawn_of(
    shown: digit_unit.ShownUnit, moved: np.ndarray, preset: str, stopped: Callable[[], bool] = lambda: False,
    better: Callable[[np.ndarray], None] = lambda picture: None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    heights = height_map.height_map(moved, shown.unit.camera)
    if preset == FAST:
        return renderer_of(shown.unit)(heights), heights
    reports.require("mitsuba")
    if not bpy.app.background:
        better(renderer_of(shown.unit)(heights))
    return tracer_process.draw(preset, shown.unit, shown.around, heights, stopped, better), heights


def fields(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, size: tuple[int, int]) -> dict[str, np.ndarray]:
    """Compute what pixels see of a gel: name -> float32 (H, W, channels). size : (width, height) px

    Names are Height (1 channel) and Displacement (3), mm, Normal (3), all in the gel object's axes, and Contact (1),
    the share that is touched, 0 to 1. Raises TactileError if no picture can be drawn.
    """
    shown, moved = shown_state(gel, depsgraph, size)
    unit = shown.unit
    heights = height_map.height_map(moved, unit.camera)
    touched = gel_place.contact_patch(moved[None], unit.camera.surface)[0]  # whatever has become of the attribute
    found = seen_fields.seen_fields(renderer_of(unit), heights, moved, touched)
    return {
        "Height": 1e3 * found["Height"][..., None], "Normal": axes.to_blender(found["Normal"], 1),
        "Contact": found["Contact"][..., None], "Displacement": axes.to_blender(found["Displacement"], 1e3),
    }  # fmt: skip


def mixed(gel: bpy.types.Object, scene: bpy.types.Scene) -> list[str]:
    """Return a sentence if a gel's LEDs, coating and camera are of another unit than the scene's calibration, of which
    the rest of its picture is: it was appended, or the preferences name another. Raises TactileError for a bad file."""
    own, other = gel.tactile.calibrated, render_settings.calibration_of(scene, properties.sensor_name(gel)).unit
    advice = "choose the first as Calibration, or Reset"
    words = f"{gel.name}: its LEDs, coating and camera are of {own}, the rest of its picture of {other}: {advice}"
    return [words] * bool(own and own != other)


def prepare(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Start the worker of a scene's Mitsuba preset, which compiles before its first picture; not without a window.

    If no picture can be drawn, this does nothing: ``draw`` will raise the error.
    """
    gel = properties.gel_of(scene)
    if bpy.app.background or gel is None or reports.missing("mitsuba"):
        return
    try:
        preset = render_settings.preset_of(scene)
        unit = render_settings.calibration_of(scene, properties.sensor_name(gel))
        shown = digit_unit.shown_unit(gel, depsgraph, unit)
        if preset != FAST:
            tracer_process.prepare(preset, shown.unit, shown.around)
    except (TactileError, OSError):
        return


def update(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, preset: str = FAST) -> bpy.types.Image:
    """Draw picture and height map by a preset into the gel's images; return the picture's. Raises TactileError."""
    return _show(gel, *shown_state(gel, depsgraph), preset)


def follow(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """Draw the fast picture again if the scene has changed what it shows. Raises TactileError."""
    shown, moved = shown_state(gel, depsgraph)
    image = images.image_of(gel, "picture")
    name, before, unit = _drawn.get("" if image is None else image.name, ("", moved, ""))
    same = (name, unit) == (gel.name, repr(shown.unit)) and moved.shape == before.shape
    if not same or np.abs(moved - before).max() > _STILL:
        _show(gel, shown, moved, FAST)


def _show(gel: bpy.types.Object, shown: digit_unit.ShownUnit, moved: np.ndarray, preset: str) -> bpy.types.Image:
    picture, heights = _drawn_of(shown, moved, preset)
    images.show(gel, "heights", heights)
    image = images.show(gel, "picture", picture)
    _drawn[image.name] = gel.name, moved, repr(shown.unit)
    return image


def show_result(operator: bpy.types.Operator, context: bpy.types.Context, gel: bpy.types.Object) -> None:
    """Show a gel's fast picture after an operator's work; report a warning if it fails, since the work is done."""
    try:
        view.show_picture(context, update(gel, context.evaluated_depsgraph_get()))
    except (TactileError, OSError) as error:
        operator.report({"WARNING"}, reports.in_blender(str(error)))


def forget() -> None:
    """Forget what pictures were drawn of, so that ``follow`` draws them again, as for a newly opened file."""
    _drawn.clear()
