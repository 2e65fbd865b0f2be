"""Build groups of geometry nodes."""

from __future__ import annotations

import bpy


class NodeGroup:
    """A geometry-node group under construction."""

    def __init__(self, label: str) -> None:
        self.tree = bpy.data.node_groups.new(label, "GeometryNodeTree")
        self.tree.is_modifier = True
        for way in ("INPUT", "OUTPUT"):
            self.tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")

    def add(self, kind: str, *links: object, **settings: object) -> bpy.types.Node:
        """Add a node; links : sockets or values of its enabled inputs, in order, None for those left alone."""
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

    def math(self, operation: str, *links: object) -> bpy.types.NodeSocket:
        """Add a math node and return its output; links : as of `add`"""
        return self.add("ShaderNodeMath", *links, operation=operation).outputs[0]

    def attribute(self, name: str, kind: str = "FLOAT") -> bpy.types.NodeSocket:
        """Add a node that reads a named attribute of the mesh; return its output."""
        node = self.add("GeometryNodeInputNamedAttribute", name, data_type=kind)
        return next(s for s in node.outputs if s.enabled and s.name == "Attribute")

    def store(self, geometry: bpy.types.NodeSocket, name: str, value: object, kind: str) -> bpy.types.NodeSocket:
        """Add a node that stores ``value`` as a named attribute of a geometry's points; return that geometry."""
        return self.add("GeometryNodeStoreNamedAttribute", geometry, None, name, value, data_type=kind,
                        domain="POINT").outputs[0]  # fmt: skip

    def input(self, name: str, kind: str, text: str, value: object = None, least: float | None = None) -> None:
        """Add an input of the group that users change in the modifier; text : what it is; least : its lower limit"""
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
