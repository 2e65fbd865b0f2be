"""The live picture: while its toggle is on, each change of frame, LED, coating, camera or gel draws it again."""

from collections.abc import Callable

import bpy
from bpy.app.handlers import persistent

from ...tactile_core.errors import TactileError
from ..objects import images
from ..process import tracer_process
from ..settings import properties, render_settings, reports
from ..settings.reports import TactileOperator
from . import pictures, stale_picture, view

_drawing = False  # a picture's own update must not draw another
_failed = ""  # why the last frame could not be drawn; shown in the panel


def is_on() -> bool:
    """Return true if the frame handler exists."""
    return _draw in bpy.app.handlers.frame_change_post


def failure() -> str:
    """Return why the last picture could not be drawn, or nothing."""
    return _failed


@persistent
def _draw(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Called at each change of the frame."""
    global _failed, _drawing
    gel = stale_picture.shown_gel(scene)
    if gel is None or depsgraph is None or _drawing:
        return
    _drawing = True
    try:
        pictures.show(gel, depsgraph, render_settings.preset_of(scene))
        _failed = ""
    except (TactileError, OSError, ModuleNotFoundError) as error:  # a handler has no report: the panel shows it
        _failed = reports.in_blender(str(error))
        stale_picture.check(scene, depsgraph)
    finally:
        _drawing = False


@persistent
def _draw_changes(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Called at each change of the scene: one of what the picture shows draws it again."""
    if any(isinstance(update.id, stale_picture.SEEN) for update in depsgraph.updates):
        _draw(scene, depsgraph)


@persistent
def _end(*_: object) -> None:
    """End the picture and its worker before another file is opened; called by Blender."""
    switch_off()


@persistent
def _keep_images(*_: object) -> None:
    """Called before a file is saved."""
    images.pack()


def switch_off() -> None:
    """Remove the handlers, and end the worker."""
    stale_picture.leave_to_live_picture(False)
    for handlers, function in _handlers():
        if function in handlers:
            handlers.remove(function)
    tracer_process.close_all()


def _handlers() -> list[tuple[list, Callable]]:
    known = bpy.app.handlers
    return [(known.frame_change_post, _draw), (known.depsgraph_update_post, _draw_changes), (known.load_pre, _end)]


class TACTILE_OT_live_picture(TactileOperator):
    """Draw the gel's picture by the preset at every change, in the Image Editor; press again to stop"""

    bl_idname = "tactile.live_picture"
    bl_label = "Live Picture"
    bl_options = {"REGISTER"}  # noqa: RUF012 (a toggle of the session, not of the file)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true where there is a gel to look at, or the picture is on: it can always be switched off."""
        return is_on() or properties.can(cls, lambda: properties.needed_gel(context.scene))

    def work(self, context: bpy.types.Context) -> None:
        """See ``TactileOperator``."""
        if is_on():
            switch_off()
            return
        gel = properties.gel_of(context.scene, context.object)
        image = pictures.update(gel, context.evaluated_depsgraph_get())
        for handlers, function in _handlers():
            handlers.append(function)
        stale_picture.leave_to_live_picture(True)
        view.show_picture(context, image)


def unregister() -> None:
    """Stop drawing; the package calls it."""
    switch_off()


CLASSES = (TACTILE_OT_live_picture,)
HANDLERS = ((bpy.app.handlers.save_pre, _keep_images),)
