"""The live picture: while its toggle is on, every frame change draws the DIGIT's fast picture."""

import bpy
from bpy.app.handlers import persistent

from ...tactile_core.errors import TactileError
from ..ui import properties
from ..ui.reports import TactileOperator
from . import pictures

_failed = ""  # why the last frame could not be drawn; shown in the panel


def is_on() -> bool:
    """Return true if the frame handler exists."""
    return _draw in bpy.app.handlers.frame_change_post


def failure() -> str:
    """Return why the last picture could not be drawn, or nothing."""
    return _failed


@persistent
def _draw(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    global _failed
    gel = properties.of_role(scene, "DIGIT")
    if gel is None or depsgraph is None:
        return
    try:
        pictures.update_picture(gel, depsgraph)
        _failed = ""
    except TactileError as error:  # a handler has no report: the panel shows it
        _failed = str(error)


def switch_off() -> None:
    """Remove the handler."""
    if is_on():
        bpy.app.handlers.frame_change_post.remove(_draw)


class TACTILE_OT_live_picture(TactileOperator):
    """Draw the DIGIT's picture at every frame change, in the Image Editor; press again to stop"""

    bl_idname = "tactile.live_picture"
    bl_label = "Live Picture"
    bl_options = {"REGISTER"}  # noqa: RUF012 (a toggle of the session, not of the file)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true where there is a gel to look at, or the picture is on: it can always be switched off."""
        if not is_on() and properties.of_role(context.scene, "DIGIT") is None:
            cls.poll_message_set("Translate a recording first, or add a DIGIT")
            return False
        return True

    def work(self, context: bpy.types.Context) -> None:
        """See ``TactileOperator``."""
        if is_on():
            switch_off()
            return
        gel = properties.of_role(context.scene, "DIGIT", context.object)
        image = pictures.update(gel, context.evaluated_depsgraph_get())
        bpy.app.handlers.frame_change_post.append(_draw)
        for area in context.screen.areas if context.screen else ():
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = image


def register() -> None:
    """Called by the package."""
    bpy.utils.register_class(TACTILE_OT_live_picture)


def unregister() -> None:
    """Called by the package."""
    switch_off()
    bpy.utils.unregister_class(TACTILE_OT_live_picture)
