"""Build trees of nodes: of materials, and groups of geometry nodes."""

from __future__ import annotations

import bpy


class Nodes:
    """Builder of a tree of nodes: each method adds a node and links it."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self.tree = tree

    def add(self, kind: str, *links: object, **settings: object) -> bpy.types.Node:
        """Add a node and return it. kind : Blender's name of its type; settings : its properties
        links : a socket or a value for each of its enabled inputs, in order; None leaves an input alone"""
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

    def output(self, kind: str, *links: object, **settings: object) -> bpy.types.NodeSocket:
        """Add a node and return its first enabled output; kind, links, settings : of `add`"""
        return next(s for s in self.add(kind, *links, **settings).outputs if s.enabled)

    def math(self, operation: str, *links: object) -> bpy.types.NodeSocket:
        """Add a math node for an ``operation`` and return its output; links : sockets or values of its inputs"""
        return self.output("ShaderNodeMath", *links, operation=operation)

    def vector(self, operation: str, *links: object) -> bpy.types.NodeSocket:
        """Add a vector math node for an ``operation`` and return its output; links : sockets or values of its inputs"""
        return self.output("ShaderNodeVectorMath", *links, operation=operation)


class NodeGroup(Nodes):
    """Builder of a new geometry-node group, ``label``, whose input and output are a geometry."""

    def __init__(self, label: str) -> None:
        super().__init__(bpy.data.node_groups.new(label, "GeometryNodeTree"))
        self.tree.is_modifier = True
        for way in ("INPUT", "OUTPUT"):
            self.tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")

    def attribute(self, name: str, kind: str = "FLOAT") -> bpy.types.NodeSocket:
        """Add a node that reads the mesh's attribute ``name``; return its output. kind : Blender's data type"""
        return self.output("GeometryNodeInputNamedAttribute", name, data_type=kind)

    def store(self, geometry: bpy.types.NodeSocket, name: str, value: object, kind: str) -> bpy.types.NodeSocket:
        """Add a node that stores ``value``, a socket or a value, as the attribute ``name`` of a geometry's points;
        return the changed geometry. kind : Blender's data type"""
        stored = geometry, None, name, value
        return self.output("GeometryNodeStoreNamedAttribute", *stored, data_type=kind, domain="POINT")

    def input(self, name: str, kind: str, text: str, value: object = None, least: float | None = None) -> None:
        """Add an input to the group, which users change in the modifier. kind : "Float", "Vector", ...; text : its
        description; value : its default; least : its lower limit"""
        item = self.tree.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        item.description = text
        if value is not None:
            item.default_value = value
        if least is not None:
            item.min_value = least

    def end(self, geometry: bpy.types.NodeSocket) -> bpy.types.NodeTree:
        """Make the geometry the group's output; return the finished group."""
        self.tree.links.new(geometry, self.tree.nodes.new("NodeGroupOutput").inputs[0])
        return self.tree
