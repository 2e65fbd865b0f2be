"""The contact patch of every frame as a mesh attribute, without a handler: an image looked up by geometry nodes.

The image has a column a node and a row a frame; it is packed into the .blend, so that the attribute plays
without the add-on.
"""

from __future__ import annotations

import bpy
import numpy as np

from . import images

ATTRIBUTE = "contact_patch"
_MODIFIER = "Tactile contact patch"


def add_patch(gel: bpy.types.Object, patch: np.ndarray, first: float, step: float) -> None:
    """Give a gel the attribute ``contact_patch``: 1 where it is touched, 0 elsewhere.

    patch : (T, n) bool; first, step : scene frame of the first row, and frames a row
    """
    rows, columns = patch.shape
    values = np.repeat(patch[:, :, None], 3, axis=2).astype(np.float32)
    image = images.new_image(f"{gel.name} contact patch", columns, rows)
    image.colorspace_settings.name = "Non-Color"  # numbers to look up, no picture
    images.fill(image, values)
    image.pack()
    modifier = gel.modifiers.get(_MODIFIER) or gel.modifiers.new(_MODIFIER, "NODES")
    old = modifier.node_group
    modifier.node_group = _group(image, rows, columns, first, step)
    if old is not None and old.users == 0:
        bpy.data.node_groups.remove(old)


def _group(image: bpy.types.Image, rows: int, columns: int, first: float, step: float) -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new(_MODIFIER, "GeometryNodeTree")
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

    # Pixel centres: (node + 0.5) / columns across; images are stored from the bottom, frames from the top.
    u = math("DIVIDE", math("ADD", nodes.new("GeometryNodeInputIndex").outputs[0], 0.5), columns)
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
    store.inputs["Name"].default_value = ATTRIBUTE
    links.new(nodes.new("NodeGroupInput").outputs[0], store.inputs["Geometry"])
    links.new(look.outputs["Color"], next(s for s in store.inputs if s.name == "Value" and s.enabled))
    links.new(store.outputs[0], nodes.new("NodeGroupOutput").inputs[0])
    for k, node in enumerate(nodes):
        node.location = (180 * (k % 6), -200 * (k // 6))
    return group
