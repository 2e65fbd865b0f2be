"""Give a mesh an attribute that changes from frame to frame: geometry nodes look it up in an image.

The image has a column per value and a row per frame; it is packed into the .blend, so that the attribute plays
without the add-on.
"""

from __future__ import annotations

import bpy
import numpy as np

from . import images
from .node_group import NodeGroup

PATCH = "contact_patch"  # of a gel: 1 where it is touched, 0 elsewhere
COUNTS = "electrode_counts"  # of a skin: change of the nearest electrode, counts


def add(
    thing: bpy.types.Object, name: str, values: np.ndarray, first: float, step: float, column: str | None = None
) -> None:
    """Give an object's mesh the attribute ``name``, which takes row after row of ``values`` (T, k), bool or float.

    first, step : the scene's frame of the first row, and scene frames per row
    column : name of the int attribute that says which column a node takes; None if node i takes column i
    """
    rows, columns = values.shape
    words = name.replace("_", " ")
    label = f"Tactile {words}"
    name_of_image = f"{thing.name} {words}"
    modifier = modifier_of(thing, name)
    if modifier is not None:
        _remove_group(modifier.node_group)
    if values.dtype == bool:
        image = images.packed_mask(name_of_image, values)
    else:
        image = bpy.data.images.new(name_of_image, columns, rows, alpha=False, float_buffer=True, is_data=True)
        images.fill(image, values.astype(np.float32))
        image.pack()
    image.colorspace_settings.name = "Non-Color"  # numbers to look up, no picture
    if modifier is None:
        modifier = thing.modifiers.new(label, "NODES")
        thing.modifiers.move(len(thing.modifiers) - 1, 0)  # before a style that shows it
    modifier.node_group = _group(label, name, image, first, step, column)


def _remove_group(group: bpy.types.NodeTree | None) -> None:
    """Remove a modifier's node group and its image, unless a copied object uses the group too."""
    if group is None or group.users > 1:
        return
    held = [socket.default_value for node in group.nodes for socket in node.inputs if socket.type == "IMAGE"]
    bpy.data.node_groups.remove(group)
    for image in filter(None, held):
        if image.users == 0:
            bpy.data.images.remove(image)


def modifier_of(thing: bpy.types.Object, name: str) -> bpy.types.Modifier | None:
    """Return the modifier that gives an object the attribute ``name``, whatever it is called; None without one."""
    for modifier in thing.modifiers:
        group = modifier.node_group if modifier.type == "NODES" else None
        stores = [node for node in group.nodes if node.type == "STORE_NAMED_ATTRIBUTE"] if group else ()
        if any(node.inputs["Name"].default_value == name for node in stores):
            return modifier
    return None


def _group(
    label: str, name: str, image: bpy.types.Image, first: float, step: float, column: str | None
) -> bpy.types.NodeTree:
    columns, rows = image.size
    nodes = NodeGroup(label)
    own = column is None
    index = nodes.output("GeometryNodeInputIndex") if own else nodes.attribute(column, "INT")
    frame = nodes.add("GeometryNodeInputSceneTime").outputs["Frame"]
    # Pixel centres: (value + 0.5) / columns across; images are stored from the bottom, frames from the top.
    u = nodes.math("DIVIDE", nodes.math("ADD", index, 0.5), columns)
    row = nodes.math("ROUND", nodes.math("DIVIDE", nodes.math("SUBTRACT", frame, first), step))
    row = nodes.math("MINIMUM", nodes.math("MAXIMUM", row, 0.0), rows - 1)
    v = nodes.math("MULTIPLY_ADD", row, -1.0 / rows, 1.0 - 0.5 / rows)
    place = nodes.output("ShaderNodeCombineXYZ", u, v)
    look = nodes.add("GeometryNodeImageTexture", image, place, interpolation="Closest", extension="EXTEND")
    geometry = nodes.tree.nodes.new("NodeGroupInput").outputs[0]
    return nodes.end(nodes.store(geometry, name, look.outputs["Color"], "FLOAT"))
