"""Make objects from ``tactile_core``'s nodes and faces, and their materials."""

from __future__ import annotations

import math

import bpy
import numpy as np

OBJECT_COLOUR = "Tactile object colour"  # material of what has no other
_SHARP = math.radians(30)  # between faces that meet in an edge


def new_mesh_object(name: str, nodes: np.ndarray, faces: np.ndarray, smooth: bool = True) -> bpy.types.Object:
    """Make an object, in no collection yet, of nodes (n, 3) in Blender units and triangles (m, 3).

    smooth : true to shade all of it smoothly, false to keep edges sharp whose faces meet at more than 30 degrees
    """
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(nodes))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(nodes, np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(faces, np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.update(calc_edges=True)
    mesh.validate()
    if not smooth:
        mesh.set_sharp_from_angle(angle=_SHARP)
    return bpy.data.objects.new(name, mesh)


def triangles_of(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return a mesh's nodes (n, 3) float32, in its own units, and its faces as triangles (m, 3)."""
    mesh.calc_loop_triangles()
    nodes, faces = np.empty(3 * len(mesh.vertices), np.float32), np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.vertices.foreach_get("co", nodes)
    mesh.loop_triangles.foreach_get("vertices", faces)
    return nodes.reshape(-1, 3), faces.reshape(-1, 3)


def paint(thing: bpy.types.Object, colour: tuple[float, float, float, float]) -> None:
    """Set an object's own colour and add a material that shows it in renders too; the colour can be animated.
    colour : red, green, blue and opacity, 0 to 1; not seen on a mesh that has another material already"""
    thing.color = colour
    thing.data.materials.append(_material())


def new_material(name: str) -> tuple[bpy.types.Material, bpy.types.Node]:
    """Make a material with nodes; return it and its Principled BSDF node."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    return material, next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def _material() -> bpy.types.Material:
    found = bpy.data.materials.get(OBJECT_COLOUR)
    if found is not None:
        return found
    material, shader = new_material(OBJECT_COLOUR)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    colour = nodes.new("ShaderNodeObjectInfo")
    colour.location = (-250, 200)
    links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    links.new(colour.outputs["Alpha"], shader.inputs["Alpha"])
    shader.inputs["Roughness"].default_value = 0.6
    material.surface_render_method = "DITHERED"
    return material
