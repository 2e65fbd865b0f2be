"""The legend of a style: a colour bar with its range and a scale bar, at the sensor's base, one mesh."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ..settings import properties
from . import style_nodes, styles, surfaces

_BEFORE = 8.0  # mm from the sensor's base, or its housing's
_LONG, _HIGH, _LETTERS = 18.0, 2.0, 3.4  # mm
_TILT = math.radians(50)  # toward a new file's view, which looks down and at the base
_UNDER = -_LETTERS - 0.2  # mm, line of the numbers
_INK = (0.95, 0.95, 0.95)
_Part = tuple[np.ndarray, np.ndarray, np.ndarray]  # corners (n, 2) mm, triangles (m, 3), colours (n, 3)


def remove_legend(thing: bpy.types.Object) -> None:
    """Remove a sensor's legend; its arrow stays."""
    arrow = styles.arrow_of(thing)
    for part in [each for each in thing.children if each.tactile.role == "LEGEND" and each != arrow]:
        bpy.data.objects.remove(part)


def add_legend(thing: bpy.types.Object, style: str, title: str, ends: tuple[str, str] | None) -> bpy.types.Object:
    """Add a colour bar, and a scale bar of 5 mm, in front of a sensor; one that is there is replaced.

    title : what the colours say; ends : what stands at the bar's ends, None where there is no bar
    """
    remove_legend(thing)
    start = 0.0 if ends is None else _LONG + 4
    parts = [_letters(title, 0.0, _HIGH + 1.0), _ruler(start), _letters("5 mm", start, _UNDER)]
    if ends is not None:
        parts += [_bar(style), _letters(ends[0], 0.0, _UNDER), _letters(ends[1], _LONG, _UNDER, "RIGHT")]
    counts = np.cumsum([0] + [len(corners) for corners, _, _ in parts])
    flat, colours = (np.concatenate([part[k] for part in parts]) for k in (0, 2))
    faces = np.concatenate([part[1] + before for part, before in zip(parts, counts, strict=False)])
    unit = thing.tactile.per_metre * 1e-3
    # The origin is the sensor's own: an other one draws a dashed line across the view.
    along, up = np.array([0, 1.0, 0]), np.array([-math.cos(_TILT), 0, math.sin(_TILT)])
    middle = (flat[:, 0].min() + flat[:, 0].max()) / 2
    nodes = _corner(thing, unit) + unit * ((flat[:, :1] - middle) * along + flat[:, 1:] * up)
    legend = surfaces.new_mesh_object(f"{thing.name} legend", nodes, faces, smooth=False)
    properties.set_up_part(legend, thing, "LEGEND")
    legend.hide_select = True
    legend["text"] = [title, *(ends or ())]
    shown = np.column_stack([colours, np.ones(len(colours))]).astype(np.float32)
    held = legend.data.color_attributes.new(style_nodes.COLOUR, "FLOAT_COLOR", "POINT")
    held.data.foreach_set("color", shown.ravel())
    styles.make_colour_active(legend.data)
    legend.data.materials.append(style_nodes.legend_material())
    return legend


def _corner(thing: bpy.types.Object, unit: float) -> np.ndarray:
    """The middle of a sensor's base, or of its housing's, and a little away from it, (3,) in its own units."""
    parts = [thing, *(part for part in thing.children if part.tactile.role == "BODY")]
    low = np.min([np.array(part.bound_box).min(0) for part in parts], axis=0)
    high = np.max([np.array(part.bound_box).max(0) for part in parts], axis=0)
    return np.array([high[0] + _BEFORE * unit, (low[1] + high[1]) / 2, low[2] + (_LETTERS + 1) * unit])


def _bar(style: str) -> _Part:
    steps = np.linspace(0, 1, 65)
    corners = np.array([[_LONG * s, w] for s in steps for w in (0, _HIGH)])
    index = np.arange(64)[:, None] * 2
    faces = np.concatenate([index + np.array(corner) for corner in ((0, 3, 1), (0, 2, 3))])
    places, colours = (np.array(each) for each in zip(*style_nodes.RAMPS[style], strict=True))
    return corners, faces, np.column_stack([np.interp(np.repeat(steps, 2), places, colours[:, k]) for k in range(3)])


def _ruler(start: float) -> _Part:
    corners = np.array([[start, 0.0], [start + 5, 0.0], [start + 5, 0.4], [start, 0.4]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(_INK, (4, 1))


def _letters(text: str, x: float, y: float, align: str = "LEFT") -> _Part:
    """Text as a mesh: text objects have no colours of their own, and are black in Solid views that show them."""
    curve = bpy.data.curves.new("legend", "FONT")
    curve.body, curve.size, curve.align_x, curve.resolution_u = text, _LETTERS, align, 2
    thing = bpy.data.objects.new("legend", curve)
    mesh = bpy.data.meshes.new_from_object(thing)
    nodes, faces = surfaces.triangles_of(mesh)
    for made, kind in ((thing, bpy.data.objects), (curve, bpy.data.curves), (mesh, bpy.data.meshes)):
        kind.remove(made)
    corners = nodes[:, :2] + np.array([x, y])
    return corners, faces, np.tile(_INK, (len(corners), 1))
