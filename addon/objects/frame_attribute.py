"""A mesh attribute of every frame, without a handler: an image looked up by geometry nodes.

The image has a column a value and a row a frame; it is packed into the .blend, so that the attribute plays
without the add-on.
"""

from __future__ import annotations

import bpy
import numpy as np

from . import images

PATCH = "contact_patch"  # of a gel: 1 where it is touched, 0 elsewhere
COUNTS = "electrode_counts"  # of a skin: change of the nearest electrode, counts


def add(
    thing: bpy.types.Object, name: str, values: np.ndarray, first: float, step: float, column: str | None = None
) -> None:
    """Give an object's mesh the attribute ``name``.

    values : (T, k), bool or float; first, step : scene frame of the first row, and frames a row
    column : int attribute that holds each node's column; each node has its own without it
    """
    rows, columns = values.shape
    words = name.replace("_", " ")
    label = f"Tactile {words}"
    image = images.new_image(f"{thing.name} {words}", columns, rows, floats=values.dtype != bool)
    image.colorspace_settings.name = "Non-Color"  # numbers to look up, no picture
    images.fill(image, values.astype(np.float32))
    image.pack()
    modifier = modifier_of(thing, name)
    if modifier is None:
        modifier = thing.modifiers.new(label, "NODES")
        thing.modifiers.move(len(thing.modifiers) - 1, 0)  # before a style that shows it
    old = modifier.node_group
    modifier.node_group = _group(label, name, image, first, step, column)
    if old is not None and old.users == 0:
        bpy.data.node_groups.remove(old)


def modifier_of(thing: bpy.types.Object, name: str) -> bpy.types.Modifier | None:
    """The modifier that gives an object the attribute ``name``, if any."""
    return thing.modifiers.get(f"Tactile {name.replace('_', ' ')}")


def _group(
    label: str, name: str, image: bpy.types.Image, first: float, step: float, column: str | None
) -> bpy.types.NodeTree:
    columns, rows = image.size
    group = bpy.data.node_groups.new(label, "GeometryNodeTree")
    group.is_modifier = True
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = group.nodes, group.links

    def math(operation: str, first_input: bpy.types.NodeSocket, value: float) -> bpy.types.NodeSocket:
        node = nodes.new("ShaderNodeMath")
        node.operation = operation
        links.new(first_input, node.inputs[0])
        node.inputs[1].default_value = value
        return node.outputs[0]

    if column is None:
        index = nodes.new("GeometryNodeInputIndex").outputs[0]
    else:
        node = nodes.new("GeometryNodeInputNamedAttribute")
        node.data_type, node.inputs["Name"].default_value = "INT", column
        index = next(s for s in node.outputs if s.enabled and s.name == "Attribute")
    # Pixel centres: (value + 0.5) / columns across; images are stored from the bottom, frames from the top.
    u = math("DIVIDE", math("ADD", index, 0.5), columns)
    row = math("DIVIDE", math("SUBTRACT", nodes.new("GeometryNodeInputSceneTime").outputs["Frame"], first), step)
    row = math("MINIMUM", math("MAXIMUM", math("ROUND", row, 0.0), 0.0), rows - 1)
    v = math("MULTIPLY_ADD", row, -1.0 / rows)
    v.node.inputs[2].default_value = 1.0 - 0.5 / rows
    place, look = nodes.new("ShaderNodeCombineXYZ"), nodes.new("GeometryNodeImageTexture")
    links.new(u, place.inputs["X"]), links.new(v, place.inputs["Y"])
    links.new(place.outputs[0], look.inputs["Vector"])
    look.interpolation, look.extension = "Closest", "EXTEND"
    look.inputs["Image"].default_value = image
    store = nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain = "FLOAT", "POINT"
    store.inputs["Name"].default_value = name
    links.new(nodes.new("NodeGroupInput").outputs[0], store.inputs["Geometry"])
    links.new(look.outputs["Color"], next(s for s in store.inputs if s.name == "Value" and s.enabled))
    links.new(store.outputs[0], nodes.new("NodeGroupOutput").inputs[0])
    for k, node in enumerate(nodes):
        node.location = (180 * (k % 6), -200 * (k // 6))
    return group
