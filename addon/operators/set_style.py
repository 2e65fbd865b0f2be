"""Choose how the sensors' surfaces are coloured, and whether their force is shown as an arrow."""

import math

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ..objects import curves, frame_attribute, motion, style_legend, style_nodes, styles
from ..objects.mesh_cache import Motion
from ..settings import properties
from ..settings.reports import TactileOperator
from . import view

_ROLES = ("BIOTAC", "DIGIT")


def _sensors(context: bpy.types.Context) -> list[bpy.types.Object]:
    found = [thing for thing in context.scene.objects if thing.tactile.role in _ROLES]
    if not found:
        raise TactileError("Tactile", "no sensor", "a BioTac or a DIGIT in the scene", "Add > Tactile > a sensor")
    properties.check_own(*found)
    return found


class TACTILE_OT_set_style(TactileOperator):
    """Colour the sensors' surfaces; the picture stays that of the true gel"""

    bl_idname = "tactile.set_style"
    bl_label = "Surface Style"

    style: bpy.props.EnumProperty(name="Style", description="What the colours say", items=styles.STYLES)
    exaggeration: bpy.props.FloatProperty(
        name="Exaggeration", description="How many times the dent is drawn", default=1.0, min=0.0, soft_max=10
    )
    largest: bpy.props.FloatProperty(
        name="Largest", description="At the colours' upper end: mm, or counts of the electrodes; 0 takes the largest of"
        " each sensor", default=0.0, min=0.0,
    )  # fmt: skip

    def _work(self, context: bpy.types.Context) -> None:
        sensors = _sensors(context)
        if self.style == "ELECTRODES" and not any(map(_counts, sensors)):
            advice = "Import it (again); of a press simulated here, the recording that is kept beside the .blend"
            raise TactileError("Tactile", "no electrodes' readings", "an imported recording", advice)
        before = len(context.scene.objects)
        for thing in sensors:
            _give(thing, self.style, self.largest, self.exaggeration)
        if len(context.scene.objects) > before:  # a first legend
            view.look_at(context, sensors)
        view.colour_by(context, "OBJECT" if self.style == "NONE" else "VERTEX")


def _give(thing: bpy.types.Object, style: str, largest: float, exaggeration: float) -> None:
    """Give a sensor a style and its legend; remove both if the style does not suit it.
    largest : value at the colours' upper end, mm or counts, 0 for the animation's; exaggeration : the dent's factor"""
    style = style if styles.can_show(thing, style) else "NONE"
    unit = thing.tactile.per_metre * 1e-3
    if style == "ELECTRODES":
        largest = largest or _counts(thing) or 1.0
        legend = ("change, counts", (f"-{largest:.0f}", f"+{largest:.0f}"))
    else:
        largest = (largest or _largest_mm(thing.tactile.largest)) * unit
        legend = ("displacement, mm", ("0", _two_digits(largest / unit)))
    styles.set_style(thing, style, largest, exaggeration)
    if style in ("DISPLACEMENT", "ELECTRODES"):
        style_legend.add_legend(thing, style, *legend)
    elif style == "CONTACT_PATCH":
        style_legend.add_legend(thing, style, "orange: in contact", None)
    else:
        style_legend.remove_legend(thing)


def take_over(thing: bpy.types.Object, other: bpy.types.Object) -> None:
    """Give a new sensor the style of another sensor, if it suits; the colours' range is that of its own values."""
    style = styles.style_of(other)
    if style != "NONE" and styles.can_show(thing, style):
        _give(thing, style, 0.0, 1.0)


def follow(thing: bpy.types.Object, before: float) -> None:
    """Renew a sensor's displacement or contact patch style for a new animation: its legend, the error below which
    colours fade, and the colours' range unless the user had set that.

    before : m, largest displacement of the animation that was replaced, 0 for none; any other range was the user's"""
    style = styles.style_of(thing)
    if style not in ("DISPLACEMENT", "CONTACT_PATCH"):
        return
    modifier, unit = thing.modifiers[styles.MODIFIER], thing.tactile.per_metre * 1e-3
    shown = style_nodes.get_input(modifier, style_nodes.LARGEST) / unit
    by_hand = not math.isclose(shown, _largest_mm(before), rel_tol=1e-4)
    _give(thing, style, shown if by_hand else 0.0, style_nodes.get_input(modifier, style_nodes.EXAGGERATION))


def animate(thing: bpy.types.Object, moved: Motion, frames: np.ndarray, how: str, values: dict[str, np.ndarray]) -> str:
    """Let a sensor play a movement at frames (T,), with its contact patch, style and custom properties; return a
    sentence for the user.

    how : "SHAPE_KEYS" or "MESH_CACHE"; values : name in ``curves.PROPERTIES`` -> (T,) or (T, k)
    """
    before = thing.tactile.largest
    summary = motion.animate(thing, moved, frames, how)
    if moved.patch is not None:
        step = frames[1] - frames[0] if len(frames) > 1 else 1.0
        frame_attribute.add(thing, frame_attribute.PATCH, moved.patch, frames[0], step)
    curves.write_properties(thing, values | {"dent_um": 1e6 * moved.dent}, frames)
    follow(thing, before)
    return summary


def _largest_mm(largest: float) -> float:
    """Return the value at the colours' upper end, mm, for a ``largest`` displacement, m; 1 mm if nothing has moved."""
    return 1e3 * largest or 1.0


def _two_digits(value: float) -> str:
    """Return a positive value as text with two digits or more, such as "1.0": a legend's 1 alone looks like an l."""
    return f"{value:.{max(0, 1 - math.floor(math.log10(value)))}f}"


def _counts(thing: bpy.types.Object) -> float:
    """Return the largest change of a sensor's electrodes, counts; 0 if it has none, or its file is too old for them."""
    if frame_attribute.modifier_of(thing, frame_attribute.COUNTS) is None:
        return 0.0
    known = range(len(thing.get("electrodes", ())))
    return max((float(np.abs(curves.values_of(thing, '["electrodes"]', k)).max(initial=0.0)) for k in known), default=0)


class TACTILE_OT_force_arrow(TactileOperator):
    """Show the force on each sensor as an arrow whose head stands in the dent; press again to remove it"""

    bl_idname = "tactile.force_arrow"
    bl_label = "Force Arrow"

    length: bpy.props.FloatProperty(
        name="Length a Newton", description="Length of an arrow of 1 N, mm", default=8.0, min=0.1, soft_max=50
    )

    def _work(self, context: bpy.types.Context) -> None:
        sensors = [thing for thing in _sensors(context) if "force" in thing]
        if not sensors:
            raise TactileError("Tactile", "no force", "a recording or a simulation", "Import, translate or simulate")
        there = [arrow for arrow in map(styles.arrow_of, sensors) if arrow is not None]
        for arrow in there:
            bpy.data.objects.remove(arrow)
        for thing in sensors if not there else ():
            styles.add_arrow(thing, self.length * thing.tactile.per_metre * 1e-3)


CLASSES = (TACTILE_OT_set_style, TACTILE_OT_force_arrow)
