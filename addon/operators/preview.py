"""Draw the gel's picture again at each change of the scene: of frame, dent, LED, coating or camera.

It is drawn by the fast preset. While Live Picture is on, it is drawn by the scene's preset, and without a window too.
"""

import bpy
from bpy.app.handlers import persistent

from ...tactile_core.errors import TactileError
from ..objects import images
from ..process import tracer_process
from ..settings import properties, render_settings, reports
from ..settings.reports import TactileOperator
from . import pictures, view

SEEN = (bpy.types.Object, bpy.types.Light, bpy.types.Camera, bpy.types.Material, bpy.types.ShaderNodeTree)
_live = False  # whether the toggle is on
_drawing = False  # a picture's own update must not draw another
_failed = ""  # why the last frame could not be drawn; shown in the panel


def is_on() -> bool:
    """Return true while Live Picture is on."""
    return _live


def failure() -> str:
    """Return why pictures could not be drawn at the last change; "" if they could."""
    return _failed


def follow(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Draw each gel's picture again: by the preset while Live Picture is on, else fast, and only if it has changed."""
    global _failed, _drawing
    if _drawing:
        return
    _drawing, failed = True, []
    try:
        for gel in [thing for thing in scene.objects if thing.tactile.role == "DIGIT"]:
            try:
                if images.image_of(gel, "picture") is None:
                    continue
                if _live:
                    pictures.update(gel, depsgraph, render_settings.preset_of(scene))
                else:
                    pictures.follow(gel, depsgraph)
            except (TactileError, OSError, ModuleNotFoundError) as error:  # a handler has no report: the panel shows it
                failed.append(reports.in_blender(str(error)))
    finally:
        _drawing = False
    _failed = "; ".join(failed)


@persistent
def _frame_changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Draw pictures again; Blender calls this at each change of the frame."""
    seen = _live or not (bpy.app.background or bpy.app.is_job_running("RENDER"))
    if depsgraph is not None and seen:
        follow(scene, depsgraph)


@persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Draw pictures again if something that they show has changed; Blender calls this at each change of the scene."""
    if any(isinstance(update.id, SEEN) for update in depsgraph.updates):
        _frame_changed(scene, depsgraph)


@persistent
def _opened(*_: object) -> None:
    """Draw pictures again, as they may be of another frame, or gone; Blender calls this after it opened a file."""
    pictures.forget()
    _frame_changed(bpy.context.scene, bpy.context.evaluated_depsgraph_get())


@persistent
def _undone(*_: object) -> None:
    """Draw pictures again after an undo or redo, and show the gel's in Image Editors that Blender emptied: it does so
    if the picture did not exist before."""
    _opened()
    gel = properties.gel_of(bpy.context.scene)
    image = None if gel is None else images.image_of(gel, "picture")
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    for area in areas if image is not None else ():
        if area.type == "IMAGE_EDITOR" and area.spaces.active.image is None:
            area.spaces.active.image = image


@persistent
def switch_off(*_: object) -> None:
    """Switch Live Picture off, and end the workers that draw for it; Blender calls this before it opens a file."""
    global _live
    _live = False
    tracer_process.close_all()


class TACTILE_OT_live_picture(TactileOperator):
    """Draw the gel's picture by the preset at every change, in the Image Editor; press again to stop"""

    bl_idname = "tactile.live_picture"
    bl_label = "Live Picture"
    bl_options = {"REGISTER"}  # noqa: RUF012 (a toggle of the session, not of the file)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true if there is a gel to look at, or if Live Picture is on: it can always be switched off."""
        return is_on() or properties.can(cls, lambda: properties.needed_gel(context.scene))

    def _work(self, context: bpy.types.Context) -> None:
        global _live
        if is_on():
            switch_off()
            return
        gel = properties.gel_of(context.scene, context.object)
        image = pictures.update(gel, context.evaluated_depsgraph_get())
        _live = True
        view.show_picture(context, image)


def unregister() -> None:
    """Switch Live Picture off when Blender switches the extension off."""
    switch_off()


CLASSES = (TACTILE_OT_live_picture,)
HANDLERS = (
    (bpy.app.handlers.save_pre, images.pack), (bpy.app.handlers.load_pre, switch_off),
    (bpy.app.handlers.load_post, _opened), (bpy.app.handlers.undo_post, _undone),
    (bpy.app.handlers.redo_post, _undone), (bpy.app.handlers.frame_change_post, _frame_changed),
    (bpy.app.handlers.depsgraph_update_post, _changed),
)  # fmt: skip
