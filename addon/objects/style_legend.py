"""The legend of a style: a colour bar with its range, and a scale bar, upright before the sensor."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ..ui import properties
from . import style_nodes, styles, surfaces

_BEFORE = 6.0  # mm in front of the sensor
_LONG, _HIGH, _LETTERS = 14.0, 1.6, 2.4  # mm
_TILT = math.radians(50)  # toward a viewer who looks down on the sensor
_INK = (0.95, 0.95, 0.95, 1.0)


def remove_legend(thing: bpy.types.Object) -> None:
    """Remove a sensor's legend; its arrow stays."""
    arrow = styles.arrow_of(thing)
    for part in [each for each in thing.children if each.tactile.role == "LEGEND" and each != arrow]:
        for piece in (*part.children, part):
            bpy.data.objects.remove(piece)


def add_legend(thing: bpy.types.Object, style: str, title: str, ends: tuple[str, str] | None) -> None:
    """A colour bar, and a scale bar of 5 mm, in front of a sensor; one that is there is replaced.

    title : what the colours say; ends : what stands at the bar's ends, None where there is no bar
    """
    remove_legend(thing)
    corners = np.array(thing.bound_box)
    frame = bpy.data.objects.new(f"{thing.name} legend", None)
    _own(thing, frame, thing)
    unit = thing.tactile.per_metre * 1e-3
    frame.location = (corners[:, 0].min(), corners[:, 1].min() - _BEFORE * unit, corners[:, 2].max())
    frame.rotation_euler, frame.scale, frame.empty_display_size = (_TILT, 0, 0), (unit, unit, unit), 0.01
    _write(thing, frame, title, (0.0, _HIGH + 0.7))
    start = 0.0
    if ends is not None:
        _bar(thing, frame, style)
        _write(thing, frame, ends[0], (0.0, -2.6))
        _write(thing, frame, ends[1], (_LONG, -2.6), "RIGHT")
        start = _LONG + 3
    ruler = np.array([[start, 0.0, 0], [start + 5, 0.0, 0], [start + 5, 0.4, 0], [start, 0.4, 0]])
    _mesh(thing, frame, "Scale bar", ruler, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(_INK, (4, 1)))
    _write(thing, frame, "5 mm", (start, -2.6))


def _bar(thing: bpy.types.Object, frame: bpy.types.Object, style: str) -> None:
    steps = np.linspace(0, 1, 65)
    corners = np.array([[_LONG * s, w, 0] for s in steps for w in (0, _HIGH)])
    index = np.arange(64)[:, None] * 2
    faces = np.concatenate([index + np.array(corner) for corner in ((0, 3, 1), (0, 2, 3))])
    places, colours = (np.array(each) for each in zip(*style_nodes.RAMPS[style], strict=True))
    shades = np.column_stack([np.interp(np.repeat(steps, 2), places, colours[:, k]) for k in range(3)])
    _mesh(thing, frame, "Colour bar", corners, faces, np.column_stack([shades, np.ones(len(shades))]))


def _mesh(thing, frame, name: str, corners: np.ndarray, faces: np.ndarray, colours: np.ndarray) -> None:  # noqa: ANN001
    part = surfaces.new_mesh_object(name, corners, faces, smooth=False)
    _own(thing, part, frame)
    styles.make_colour_active(part.data)
    part.data.color_attributes[style_nodes.COLOUR].data.foreach_set("color", colours.astype(np.float32).ravel())
    part.data.materials.append(style_nodes.legend_material())


def _own(thing: bpy.types.Object, part: bpy.types.Object, parent: bpy.types.Object) -> None:
    properties.set_up(part, "LEGEND", thing.tactile.per_metre)
    thing.users_collection[0].objects.link(part)
    part.parent, part.hide_select, part.color = parent, True, _INK


def _write(
    thing: bpy.types.Object, frame: bpy.types.Object, text: str, place: tuple[float, float], align: str = "LEFT"
) -> None:
    letters = bpy.data.curves.new("legend", "FONT")
    letters.body, letters.size, letters.align_x = text, _LETTERS, align
    letters.materials.append(style_nodes.ink())
    part = bpy.data.objects.new(f"Legend {text}", letters)
    _own(thing, part, frame)
    part.location = (*place, 0.0)
