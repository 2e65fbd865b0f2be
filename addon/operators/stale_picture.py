"""A picture of another dent, or by other lights, than the scene shows now is dimmed until it is drawn again."""

from __future__ import annotations

import dataclasses

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...tactile_core.errors import TactileError
from ..objects import digit_objects, digit_unit, images
from ..settings import properties, render_settings

DIM = 0.3  # of a stale picture's brightness
_STALE = "tactile_stale"  # property of the picture's datablock in a saved file
_STILL = 1e-7  # m, of displacements that are read back from float32 coordinates
SEEN = (bpy.types.Object, bpy.types.Light, bpy.types.Camera, bpy.types.Material, bpy.types.ShaderNodeTree)


@dataclasses.dataclass
class _Known:
    """What the picture was drawn of: gel, its displacement (n, 3) m and unit, None where unknown.

    bright : its pixels while it is dim; live : whether each change draws it again
    """

    gel: str = ""
    drawn: tuple[np.ndarray, str] | None = None
    bright: np.ndarray | None = None
    live: bool = False


_known = _Known()


def remember(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """Remember what the picture has just been drawn of."""
    _known.gel, _known.drawn, _known.bright = gel.name, _state(gel, depsgraph), None


def leave_to_live_picture(live: bool) -> None:
    """Dim nothing while the live picture is on, which draws each change."""
    _known.live = live


def shown_gel(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return the gel whose picture was drawn last, else the one that is meant."""
    last = scene.objects.get(_known.gel)
    return last if last is not None and last.tactile.role == "DIGIT" else properties.gel_of(scene)


def is_stale() -> bool:
    """Return whether the picture is dimmed."""
    return _known.bright is not None


def check(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Dim the picture if the scene has left what it was drawn of, and give it its light back on return."""
    gel = shown_gel(scene)
    image = None if gel is None else images.picture_of(gel)
    if image is None or gel is None or _known.drawn is None:
        return
    try:
        moved, unit = _state(gel, depsgraph)
        other = moved.shape != _known.drawn[0].shape  # a gel of another sensor
        stale = other or unit != _known.drawn[1] or np.abs(moved - _known.drawn[0]).max() > _STILL
    except TactileError:  # of a gel or a lamp that has no picture
        stale = True
    if stale == is_stale():
        return
    if stale:
        _known.bright = np.empty(4 * image.size[0] * image.size[1], np.float32)
        image.pixels.foreach_get(_known.bright)
        pixels = _known.bright * np.tile(np.float32([DIM, DIM, DIM, 1]), len(_known.bright) // 4)
    else:
        pixels, _known.bright = _known.bright, None
    image.pixels.foreach_set(pixels)
    image.update()


def _state(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[np.ndarray, str]:
    unit = render_settings.calibration_of(depsgraph.scene, properties.sensor_name(gel))
    shown = digit_unit.shown_unit(gel, depsgraph, unit)
    return digit_objects.displacement_of(gel, depsgraph), repr(shown.unit)


@persistent
def _frame_changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Check the picture at each change of the frame; Blender calls it."""
    if depsgraph is not None and not _known.live and not bpy.app.is_job_running("RENDER"):
        check(scene, depsgraph)


@persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Check the picture at each change of the scene; Blender calls it."""
    if any(isinstance(update.id, SEEN) for update in depsgraph.updates):
        _frame_changed(scene, depsgraph)


@persistent
def _note(*_: object) -> None:
    """Let a file that is saved know whether its picture is dim; called by Blender."""
    gel = shown_gel(bpy.context.scene)
    image = None if gel is None else images.picture_of(gel)
    if image is not None:
        image[_STALE] = is_stale()


@persistent
def _take_up(*_: object) -> None:
    """Take the picture of an opened file to be of the frame it opens on, unless it was dim; called by Blender."""
    _known.gel, _known.drawn, _known.bright = "", None, None
    gel = properties.gel_of(bpy.context.scene)
    image = None if gel is None else images.picture_of(gel)
    if image is not None and gel is not None and not image.get(_STALE, False):
        try:
            _known.drawn = _state(gel, bpy.context.evaluated_depsgraph_get())
        except TactileError:  # its picture says nothing of a gel that has none
            return


HANDLERS = [(bpy.app.handlers.save_pre, _note), (bpy.app.handlers.load_post, _take_up)]
if not bpy.app.background:  # where nobody sees it
    HANDLERS += [
        (bpy.app.handlers.frame_change_post, _frame_changed), (bpy.app.handlers.depsgraph_update_post, _changed),
    ]  # fmt: skip
