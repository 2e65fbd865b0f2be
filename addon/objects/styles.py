"""Styles of a sensor's surface: geometry nodes that colour it by displacement or contact, in Solid views too.

The node groups play without the add-on: the rest is Blender's own attribute ``rest_position``. They leave
``displacement`` (a vector, in the object's units) and ``Tactile colour`` on the mesh.
"""

from __future__ import annotations

import bpy

from . import patch_nodes

COLOUR, DISPLACEMENT = "Tactile colour", "displacement"
MODIFIER = "Tactile style"
RAMP = ((0.0, (0.50, 0.50, 0.53)), (0.05, (0.10, 0.15, 0.45)), (0.35, (0.0, 0.45, 0.55)),
         (0.65, (0.35, 0.72, 0.25)), (1.0, (0.98, 0.85, 0.10)))  # fmt: skip
_TOUCHED, _FREE = (0.95, 0.35, 0.05, 1.0), (0.50, 0.50, 0.53, 1.0)
STYLES = (
    ("DISPLACEMENT", "Displacement", "Colour by how far each place has moved"),
    ("CONTACT_PATCH", "Contact Patch", "Colour what is touched; of a DIGIT's gel"),
    ("NONE", "Material", "Show the surface's own material"),
)


def set_style(thing: bpy.types.Object, style: str, largest: float, exaggeration: float) -> None:
    """Give a sensor one style in place of another.

    largest : the object's units, at the colours' upper end; exaggeration : how many times the dent is drawn
    """
    old = thing.modifiers.get(MODIFIER)
    if old is not None:
        group = old.node_group
        thing.modifiers.remove(old)
        if group is not None and group.users == 0:
            bpy.data.node_groups.remove(group)
    if style == "NONE":
        return
    thing.add_rest_position_attribute = True
    make_colour_active(thing.data)
    modifier = thing.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = _group(style, largest, exaggeration)


def make_colour_active(mesh: bpy.types.Mesh) -> None:
    """Let Solid views colour by the attribute that the nodes write: they show the mesh's active one of that name."""
    if COLOUR not in mesh.color_attributes:
        mesh.color_attributes.new(COLOUR, "FLOAT_COLOR", "POINT")
    mesh.color_attributes.active_color = mesh.color_attributes[COLOUR]


class _Nodes:
    """A geometry-node group under construction."""

    def __init__(self, name: str) -> None:
        self.tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
        self.tree.is_modifier = True
        for way in ("INPUT", "OUTPUT"):
            self.tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")

    def add(self, kind: str, *links: object, **settings: object) -> bpy.types.Node:
        """A node; links : sockets or values of its enabled inputs, in order, None for those left alone."""
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, value in zip([s for s in node.inputs if s.enabled], links, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            elif value is not None:
                socket.default_value = value
        node.location = (190 * (len(self.tree.nodes) % 6), -220 * (len(self.tree.nodes) // 6))
        return node

    def number(self, name: str, value: float, least: float, most: float, text: str) -> bpy.types.NodeSocket:
        """An input of the group that users change in the modifier."""
        item = self.tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
        item.default_value, item.min_value, item.max_value, item.description = value, least, most, text
        return item


def _group(style: str, largest: float, exaggeration: float) -> bpy.types.NodeTree:
    nodes = _Nodes(f"Tactile {style.replace('_', ' ').title()}")
    nodes.number("Largest", largest, 1e-6, 1e6, "Displacement at the colours' upper end, in the object's units")
    nodes.number(
        "Exaggeration", exaggeration, 0.0, 100.0, "How many times the dent is drawn; pictures keep the true one"
    )
    given = nodes.tree.nodes.new("NodeGroupInput")
    rest = nodes.add("GeometryNodeInputNamedAttribute", "rest_position", data_type="FLOAT_VECTOR")
    rest = next(s for s in rest.outputs if s.enabled and s.name == "Attribute")
    moved = nodes.add(
        "ShaderNodeVectorMath", nodes.add("GeometryNodeInputPosition").outputs[0], rest, operation="SUBTRACT"
    )
    kept = nodes.add(
        "GeometryNodeStoreNamedAttribute", given.outputs["Geometry"], None, DISPLACEMENT, moved.outputs[0],
        data_type="FLOAT_VECTOR", domain="POINT",
    )  # fmt: skip
    again = nodes.add("GeometryNodeInputNamedAttribute", DISPLACEMENT, data_type="FLOAT_VECTOR")
    again = next(s for s in again.outputs if s.enabled and s.name == "Attribute")
    if style == "DISPLACEMENT":
        length = nodes.add("ShaderNodeVectorMath", again, operation="LENGTH").outputs["Value"]
        share = nodes.add("ShaderNodeMath", length, given.outputs["Largest"], operation="DIVIDE").outputs[0]
    else:
        patch = nodes.add("GeometryNodeInputNamedAttribute", patch_nodes.ATTRIBUTE, data_type="FLOAT")
        share = next(s for s in patch.outputs if s.enabled and s.name == "Attribute")
    ramp = nodes.add("ShaderNodeValToRGB", share)
    _colour(ramp.color_ramp, style)
    shown = nodes.add(
        "GeometryNodeStoreNamedAttribute", kept.outputs[0], None, COLOUR, ramp.outputs["Color"],
        data_type="FLOAT_COLOR", domain="POINT",
    )  # fmt: skip
    more = nodes.add("ShaderNodeMath", given.outputs["Exaggeration"], 1.0, operation="SUBTRACT").outputs[0]
    extra = nodes.add("ShaderNodeVectorMath", again, operation="SCALE")
    nodes.tree.links.new(more, extra.inputs["Scale"])
    placed = nodes.add("GeometryNodeSetPosition", shown.outputs[0])
    nodes.tree.links.new(extra.outputs[0], placed.inputs["Offset"])
    painted = nodes.add("GeometryNodeSetMaterial", placed.outputs[0])
    painted.inputs["Material"].default_value = material()
    nodes.tree.links.new(painted.outputs[0], nodes.tree.nodes.new("NodeGroupOutput").inputs[0])
    return nodes.tree


def _colour(ramp: bpy.types.ColorRamp, style: str) -> None:
    if style == "CONTACT_PATCH":
        ramp.interpolation = "CONSTANT"
        ramp.elements[0].color, ramp.elements[1].color, ramp.elements[1].position = _FREE, _TOUCHED, 0.5
        return
    for place, colour in RAMP[1:-1]:
        ramp.elements.new(place).color = (*colour, 1.0)
    ramp.elements[0].color, ramp.elements[-1].color = (*RAMP[0][1], 1.0), (*RAMP[-1][1], 1.0)


def material() -> bpy.types.Material:
    """A material of the attribute ``Tactile colour``."""
    found = bpy.data.materials.get(MODIFIER)
    if found is not None:
        return found
    made = bpy.data.materials.new(MODIFIER)
    if made.node_tree is None:
        made.use_nodes = True
    nodes = made.node_tree.nodes
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    colour = nodes.new("ShaderNodeVertexColor")
    colour.layer_name = COLOUR
    made.node_tree.links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.5
    return made
