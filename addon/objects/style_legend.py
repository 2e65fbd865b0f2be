"""The legend of a displacement style: a colour bar with its range, and a scale bar."""

from __future__ import annotations

import bpy
import numpy as np

from ..ui import properties
from . import styles, surfaces

_BEFORE = 8  # mm in front of the sensor
_INK = (0.95, 0.95, 0.95, 1.0)


def add_legend(thing: bpy.types.Object, largest: float, shown: bool = True) -> None:
    """A colour bar with its range, and a scale bar of 5 mm, in front of a sensor; one that is there is replaced."""
    for part in [each for each in thing.children if each.tactile.role == "LEGEND"]:
        bpy.data.objects.remove(part)
    if not shown:
        return
    per_mm = thing.tactile.per_metre * 1e-3
    corners = np.array(thing.bound_box)
    low, high = corners.min(0), corners.max(0)
    left, front, top = float(low[0]), float(low[1]) - _BEFORE * per_mm, float(high[2])
    steps = np.linspace(0, 1, 33)
    corners = np.array([[left + 12 * per_mm * s, front - w * per_mm, top] for s in steps for w in (0, 1.2)])
    index = np.arange(32)[:, None] * 2
    faces = np.concatenate([index + np.array(corner) for corner in ((0, 1, 3), (0, 3, 2))])
    bar = _legend_part(thing, "Displacement legend", surfaces.new_mesh_object("legend", corners, faces, False).data)
    styles.make_colour_active(bar.data)
    places, colours = np.array([p for p, _ in styles.RAMP]), np.array([c for _, c in styles.RAMP])
    shades = np.column_stack([np.interp(np.repeat(steps, 2), places, colours[:, k]) for k in range(3)])
    values = np.column_stack([shades, np.ones(len(shades))]).astype(np.float32)
    bar.data.color_attributes[styles.COLOUR].data.foreach_set("color", values.ravel())
    bar.data.materials.append(styles.material())
    for text, along in (("0", 0.0), (f"{largest / per_mm:.2g} mm", 11.0)):
        _write(thing, text, (left + along * per_mm, front - 3.2 * per_mm, top), per_mm)
    start = left + 18 * per_mm
    ruler = np.array(
        [[start + x * per_mm, front - y * per_mm, top] for x, y in ((0, 0.9), (5, 0.9), (5, 1.2), (0, 1.2))]
    )
    _legend_part(
        thing, "Scale bar", surfaces.new_mesh_object("bar", ruler, np.array([[0, 2, 1], [0, 3, 2]]), False).data
    )
    _write(thing, "5 mm", (start, front - 3.2 * per_mm, top), per_mm)


def _legend_part(thing: bpy.types.Object, name: str, data: bpy.types.ID) -> bpy.types.Object:
    part = bpy.data.objects.new(name, data)
    properties.set_up(part, "LEGEND", thing.tactile.per_metre)
    thing.users_collection[0].objects.link(part)
    part.parent, part.hide_select, part.color = thing, True, _INK
    return part


def _write(thing: bpy.types.Object, text: str, place: tuple[float, float, float], per_mm: float) -> None:
    letters = bpy.data.curves.new("legend", "FONT")
    letters.body, letters.size = text, 1.8 * per_mm
    # Moved within its plane: an origin over the sensor's own draws no dashed line across the view.
    letters.offset_x, letters.offset_y = place[0], place[1]
    _legend_part(thing, f"Legend {text}", letters).location.z = place[2]
