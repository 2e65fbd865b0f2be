"""Make indenter objects of specs (kind and sizes, as in a scene file), and read specs back from objects. A user's own
mesh can be an indenter too: it has no spec until it is read.

`thing` is an indenter's object; `depsgraph` holds the scene on this frame, keys and modifiers applied.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.geometry.indenters import mesh_file
from ...tactile_core.geometry.indenters.indenter import Surface
from ..settings import properties
from . import axes, surfaces

COLOUR = (0.85, 0.55, 0.2, 1.0)
_LOWEST = 1e-7  # m: vertices this near to the lowest one belong to one flat, as mesh_file has it
_DIRECTIONS = 4000  # hull points of a body: edges of 0.5 mm round then look round


def add_indenter(group: bpy.types.Collection, spec: Any, per_metre: float) -> bpy.types.Object:
    """Add an object for a spec of ``indenter_specs`` and return it. Its origin is the point that touches first.
    per_metre : Blender units in a metre"""
    import msgspec

    nodes, faces = shape_of(spec)
    # Own frame and Blender's axes agree where the pad looks up: z out of the sensor, x along the finger.
    thing = surfaces.new_mesh_object(spec.name, nodes * per_metre, faces, smooth=False)
    about = properties.set_up(thing, "INDENTER", per_metre)
    about.spec = json.dumps(msgspec.to_builtins(spec))
    thing["tactile_shape"] = fingerprint(thing)
    group.objects.link(thing)
    surfaces.paint(thing, COLOUR)
    return thing


def fingerprint(thing: bpy.types.Object) -> str:
    """Return a hash that changes when the mesh's own vertices do."""
    nodes = np.empty(len(thing.data.vertices) * 3, np.float32)
    thing.data.vertices.foreach_get("co", nodes)
    return hashlib.sha256(nodes.tobytes()).hexdigest()[:16]


def check_pose(thing: bpy.types.Object, relative: np.ndarray) -> None:
    """Raise TactileError for an object that cannot press: it is edited or mirrored, or was made from a spec and later
    changed.

    relative : (3, 3), the object's axes by ``world_axes``
    """
    if thing.mode == "EDIT":  # its mesh is as it was before
        raise TactileError(thing.name, "in Edit Mode", "Object Mode", "Press Tab over the 3D view")
    if np.linalg.det(relative) <= 0:
        advice = "Apply the scale (Ctrl A) and flip normals"
        raise TactileError(thing.name, "its scale is negative or zero", "a scale above 0", advice)
    if thing.tactile.spec and not np.allclose(relative, np.eye(3), atol=1e-4):
        advice = "Clear its rotation and scale, or choose Press with the Mesh as It Is in the sidebar"
        raise TactileError(thing.name, "turned or scaled", "an upright body of the sizes it was made with", advice)
    if thing.tactile.spec and (thing.modifiers or fingerprint(thing) != thing.get("tactile_shape")):
        advice = "Undo that, or choose Press with the Mesh as It Is in the sidebar"
        raise TactileError(thing.name, "its mesh was edited or has modifiers", "the body it was made as", advice)


def spec_of(thing: bpy.types.Object, relative: np.ndarray, depsgraph: bpy.types.Depsgraph) -> tuple[Any, bytes | None]:
    """Return the spec of an indenter object, and the bytes of its mesh file or None for a shape without one.

    relative : (3, 3), the object's axes by ``world_axes``
    Raises TactileError for an object that cannot press (`check_pose`), and for a mesh file that cannot be read.
    """
    import msgspec

    from ...tactile_core.simulation.indenter_specs import IndenterSpec, MeshSpec

    check_pose(thing, relative)
    if not thing.tactile.spec:
        name = bpy.path.clean_name(thing.name)
        return MeshSpec(name=name, file=f"{name}.stl"), stl_of(thing, relative, depsgraph)
    spec = msgspec.convert(json.loads(thing.tactile.spec), IndenterSpec)
    if not isinstance(spec, MeshSpec):
        return spec, None
    path = Path(spec.file)
    try:
        return msgspec.structs.replace(spec, file=path.name), path.read_bytes()
    except OSError as error:
        found = f"its mesh cannot be read ({error.strerror})"
        raise TactileError(f"{thing.name}, {path}", found, "the file it came from", "Import the scene again") from error


def triangles_of(thing: bpy.types.Object, relative: np.ndarray, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """Return the object's triangles (m, 3, 3), modifiers applied, in Blender units from its origin and in a sensor
    object's axes. relative : (3, 3), the object's axes by ``world_axes``. Raises TactileError without faces."""
    nodes, corners = surfaces.triangles_of(thing.evaluated_get(depsgraph).data)
    if not len(corners):
        raise TactileError(thing.name, "no faces", "a closed mesh", "Select a mesh with a surface")
    return (nodes @ relative.T)[corners]


def stl_of(thing: bpy.types.Object, relative: np.ndarray, depsgraph: bpy.types.Depsgraph) -> bytes:
    """Return the surface as a binary STL in mm, z out of the sensor. relative : (3, 3), axes by ``world_axes``"""
    corners = triangles_of(thing, relative, depsgraph) * np.float32(1e3 / thing.tactile.per_metre)
    record = np.zeros(len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")]))
    record["corners"] = corners
    return b"Tactile, mm".ljust(80, b" ") + struct.pack("<I", len(corners)) + record.tobytes()


def foot_of(thing: bpy.types.Object, relative: np.ndarray, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """Return the vector (3,), Blender units, in the sensor object's axes, z outward, from the indenter's origin to the
    point that touches first; zero for a spec's body. relative : (3, 3), the indenter's axes by ``world_axes``"""
    if thing.tactile.spec:
        return np.zeros(3)
    nodes = triangles_of(thing, relative, depsgraph).reshape(-1, 3)
    low = nodes[nodes[:, 2] < nodes[:, 2].min() + _LOWEST * thing.tactile.per_metre]
    return np.array([*(low.min(axis=0) + low.max(axis=0))[:2] / 2, low[:, 2].min()])


def world_axes(thing: bpy.types.Object, sensor: bpy.types.Object) -> np.ndarray:
    """Return the object's axes, as long as its scale, as columns (3, 3) in a sensor object's own axes, z outward."""
    return np.array(axes.from_world(sensor) @ thing.matrix_world)[:3, :3]


def place_of(thing: bpy.types.Object, sensor: bpy.types.Object, foot: np.ndarray) -> np.ndarray:
    """Return the indenter's point that touches first, (3,) m in the sensor's frame.
    foot : (3,), Blender units, from the indenter's origin to that point, by ``foot_of``"""
    origin = np.array((axes.from_world(sensor) @ thing.matrix_world).translation)
    return axes.to_sensor(origin + foot, sensor.tactile.per_metre)


def shape_of(spec: Any) -> Surface:
    """Return the nodes (n, 3) m and triangles (m, 3) of a spec's body; its own z points out of the sensor."""
    from ...tactile_core.simulation.indenter_specs import MeshSpec  # needs msgspec

    if isinstance(spec, MeshSpec):
        mesh = mesh_file.solid(mesh_file.read_bytes(spec.file), spec.file, spec.unit_mm * 1e-3, spec.up)
        return np.asarray(mesh.vertices) * 1e-3, np.asarray(mesh.faces)
    return spec.build().preview(_hull)


def _hull(support: Callable[[np.ndarray], np.ndarray]) -> Surface:
    """Return nodes (n, 3) m and triangles (m, 3) of the convex hull of a body's farthest points in many directions.
    support : returns the body's point (3,) m that lies farthest along a unit vector (3,)"""
    k = np.arange(_DIRECTIONS) + 0.5
    polar, turn = np.arccos(1 - 2 * k / _DIRECTIONS), np.pi * (1 + 5**0.5) * k
    directions = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], -1)
    points = np.unique(np.round([support(direction) for direction in directions], 7), axis=0)
    shape = bmesh.new()
    for point in points * 1e3:  # in mm: bmesh's tolerances are absolute
        shape.verts.new(point)
    bmesh.ops.convex_hull(shape, input=shape.verts)
    loose = [vertex for vertex in shape.verts if not vertex.link_faces]
    bmesh.ops.delete(shape, geom=loose, context="VERTS")
    shape.verts.index_update()
    nodes = np.array([vertex.co[:] for vertex in shape.verts]) * 1e-3
    faces = np.array([[vertex.index for vertex in face.verts] for face in shape.faces])
    shape.free()
    return nodes, faces
