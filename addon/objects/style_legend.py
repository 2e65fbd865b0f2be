"""Add a style's legend: a card below the sensor that faces the scene's camera, with a colour bar and a scale bar."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Quaternion

from ..settings import properties
from . import style_nodes, styles, surfaces
from .node_group import NodeGroup

_LONG, _HIGH, _LETTERS = 18.0, 1.8, 2.3  # mm
_EDGE, _LIFT = 1.0, 0.3  # mm, the card's margin, and its distance below its content: views resolve .05 only from near
_GAP = 1.5  # mm between sensor and card, as the camera sees them
_INK, _CARD = (0.95, 0.95, 0.95), (0.03, 0.03, 0.035)
_MIDDLE, _HALF = "Middle", "Half"
_NEAR = 3.0  # times half a sensor's diagonal: a nearer camera is the sensor's own, or a new file's hidden one
_STRAIGHT = 0.999  # cosine: a camera that looks up so straight is in another sensor
# Rotation of a new file's view, used without a camera.
_NO_CAMERA = Quaternion((0.7124, 0.4411, 0.2874, 0.4641)).normalized().to_euler()
_Part = tuple[np.ndarray, np.ndarray, np.ndarray]  # corners (n, 2) mm, triangles (m, 3), colours (n, 3)


def remove_legend(thing: bpy.types.Object) -> None:
    """Remove a sensor's legend; its arrow stays."""
    arrow = styles.arrow_of(thing)
    for part in [each for each in thing.children if each.tactile.role == "LEGEND" and each != arrow]:
        bpy.data.objects.remove(part)


def add_legend(thing: bpy.types.Object, style: str, title: str, ends: tuple[str, str] | None) -> None:
    """Give a sensor a card with a colour bar and a scale bar of 5 mm, which works without the add-on.

    style : whose colours the bar shows; title : what the colours say
    ends : texts at the bar's left and right end, None for no bar
    """
    remove_legend(thing)
    row = -_EDGE - _LETTERS
    parts = [_letters(title, 0.0, row)]
    if ends is not None:
        row -= _HIGH + 0.9
        parts += [
            _bar(style, row),
            _letters(ends[0], 0.0, row - _LETTERS),
            _letters(ends[1], _LONG, row - _LETTERS, "RIGHT"),
        ]
        row -= _LETTERS
    row -= _LETTERS + 0.6
    parts += [_patch(0.0, 5.0, row + 0.6, row + 1.1, _INK), _letters("5 mm", 6.0, row)]
    parts.insert(0, _patch(-_EDGE, _LONG + _EDGE, row - _EDGE, 0.0, _CARD))
    counts = np.cumsum([0] + [len(corners) for corners, _, _ in parts])
    flat, colours = (np.concatenate([part[k] for part in parts]) for k in (0, 2))
    faces = np.concatenate([part[1] + before for part, before in zip(parts, counts, strict=False)])
    front = np.column_stack(
        [flat[:, 0] - _LONG / 2, flat[:, 1], np.where(np.arange(len(flat)) < counts[1], 0.0, _LIFT)]
    )
    nodes = np.concatenate([front, front * [-1, 1, -1]])  # read from behind too
    unit = thing.tactile.per_metre * 1e-3
    both = np.concatenate([faces, faces + len(front)])
    legend = surfaces.new_mesh_object(f"{thing.name} legend", nodes * unit, both, smooth=False)
    properties.set_up_part(legend, thing, "LEGEND")
    legend.hide_select = True
    legend.visible_shadow = legend.visible_diffuse = legend.visible_glossy = False
    legend["text"] = [title, *(ends or ())]
    shown = np.column_stack([colours, np.ones(len(colours))]).astype(np.float32)
    held = legend.data.color_attributes.new(style_nodes.COLOUR, "FLOAT_COLOR", "POINT")
    held.data.foreach_set("color", np.concatenate([shown, shown]).ravel())
    styles.make_colour_active(legend.data)
    legend.data.materials.append(style_nodes.legend_material())
    modifier = legend.modifiers.new(style_nodes.LEGEND, "NODES")
    modifier.node_group = bpy.data.node_groups.get(style_nodes.LEGEND) or _facing()
    body = [thing, *(part for part in thing.children if part.tactile.role == "BODY")]
    corners = np.concatenate([np.array(part.bound_box) for part in body])
    low, high = corners.min(0), corners.max(0)
    style_nodes.set_input(modifier, _MIDDLE, tuple((low + high) / 2))
    style_nodes.set_input(modifier, _HALF, tuple((high - low) / 2 + _GAP * unit))


def _facing() -> bpy.types.NodeTree:
    """Make the node group that turns a mesh toward the active camera, and puts it below the sensor as that sees it."""
    nodes = NodeGroup(style_nodes.LEGEND)
    nodes.input(_MIDDLE, "Vector", "Middle of the sensor")
    nodes.input(_HALF, "Vector", "Half its size")
    given = nodes.tree.nodes.new("NodeGroupInput")
    camera = nodes.output("GeometryNodeInputActiveCamera")
    seen = nodes.add("GeometryNodeObjectInfo", camera, transform_space="RELATIVE")
    away = nodes.vector("DISTANCE", seen.outputs["Location"], given.outputs[_MIDDLE])
    half = nodes.vector("LENGTH", given.outputs[_HALF])
    near = nodes.math("MULTIPLY", half, _NEAR)
    ahead = nodes.output("FunctionNodeRotateVector", (0.0, 0.0, -1.0), seen.outputs["Rotation"])
    slanted = nodes.math("LESS_THAN", nodes.vector("DOT_PRODUCT", ahead, (0.0, 0.0, 1.0)), _STRAIGHT)
    away = nodes.math("MULTIPLY", away, slanted)
    there = nodes.output("FunctionNodeCompare", away, near, operation="GREATER_THAN")
    turn = nodes.output("GeometryNodeSwitch", there, _NO_CAMERA, seen.outputs["Rotation"], input_type="ROTATION")
    down = nodes.output("FunctionNodeRotateVector", (0.0, -1.0, 0.0), turn)
    reach = nodes.vector("ABSOLUTE", down)
    reach = nodes.vector("DOT_PRODUCT", reach, given.outputs[_HALF])
    below = nodes.vector("SCALE", down, reach)
    place = nodes.vector("ADD", given.outputs[_MIDDLE], below)
    placed = nodes.add("GeometryNodeTransform", given.outputs["Geometry"])
    nodes.tree.links.new(place, placed.inputs["Translation"])
    nodes.tree.links.new(turn, placed.inputs["Rotation"])
    return nodes.end(placed.outputs[0])


def _bar(style: str, low: float) -> _Part:
    steps = np.linspace(0, 1, 65)
    corners = np.array([[_LONG * s, low + w] for s in steps for w in (0, _HIGH)])
    index = np.arange(64)[:, None] * 2
    faces = np.concatenate([index + np.array(corner) for corner in ((0, 3, 1), (0, 2, 3))])
    places, colours = (np.array(each) for each in zip(*style_nodes.RAMPS[style], strict=True))
    return corners, faces, np.column_stack([np.interp(np.repeat(steps, 2), places, colours[:, k]) for k in range(3)])


def _patch(left: float, right: float, low: float, high: float, colour: tuple[float, float, float]) -> _Part:
    corners = np.array([[left, low], [right, low], [right, high], [left, high]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(colour, (4, 1))


def _letters(text: str, x: float, y: float, align: str = "LEFT") -> _Part:
    """Make a mesh of a text at x, y mm on the card: text objects cannot be coloured, and are black in Solid views.
    align : the text's side that is at x, "LEFT" or "RIGHT\""""
    curve = bpy.data.curves.new("legend", "FONT")
    curve.body, curve.size, curve.align_x, curve.resolution_u = text, _LETTERS, align, 2
    thing = bpy.data.objects.new("legend", curve)
    mesh = bpy.data.meshes.new_from_object(thing)
    nodes, faces = surfaces.triangles_of(mesh)
    for made, kind in ((thing, bpy.data.objects), (curve, bpy.data.curves), (mesh, bpy.data.meshes)):
        kind.remove(made)
    corners = nodes[:, :2] + np.array([x, y])
    return corners, faces, np.tile(_INK, (len(corners), 1))
