"""Choose how the sensors' surfaces are coloured: by displacement, by contact, or by their own material."""

import bpy

from ...tactile_core.errors import TactileError
from ..objects import style_legend, styles
from ..ui import view
from ..ui.reports import TactileOperator

_ROLES = ("BIOTAC", "DIGIT")


class TACTILE_OT_set_style(TactileOperator):
    """Colour the sensors' surfaces; the picture stays that of the true gel"""

    bl_idname = "tactile.set_style"
    bl_label = "Surface Style"

    style: bpy.props.EnumProperty(name="Style", description="What the colours say", items=styles.STYLES)
    exaggeration: bpy.props.FloatProperty(
        name="Exaggeration", description="How many times the dent is drawn", default=1.0, min=0.0, soft_max=10
    )
    largest: bpy.props.FloatProperty(
        name="Largest", description="Displacement at the colours' upper end, mm; 0 takes the largest of each sensor",
        default=0.0, min=0.0,
    )  # fmt: skip

    def work(self, context: bpy.types.Context) -> None:
        """See ``TactileOperator``."""
        sensors = [thing for thing in context.scene.objects if thing.tactile.role in _ROLES]
        if not sensors:
            raise TactileError("Tactile", "no sensor", "a BioTac or a DIGIT in the scene", "Add > Tactile > a sensor")
        for thing in sensors:
            per_metre = thing.tactile.per_metre
            largest = (1e-3 * self.largest or thing.tactile.largest or 1e-3) * per_metre
            patch = self.style == "CONTACT_PATCH" and thing.tactile.role != "DIGIT"
            styles.set_style(thing, "NONE" if patch else self.style, largest, self.exaggeration)
            style_legend.add_legend(thing, largest, shown=self.style == "DISPLACEMENT")
        view.colour_by(context, "OBJECT" if self.style == "NONE" else "VERTEX")


register, unregister = bpy.utils.register_classes_factory((TACTILE_OT_set_style,))
