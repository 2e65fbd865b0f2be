"""Meshes that show the indenters of ``tactile_core.simulation.indenter_specs``, in their own frame and in metres."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bmesh
import numpy as np

from ...tactile_core.geometry.indenters import mesh_file
from ...tactile_core.geometry.indenters.indenter import Surface
from ...tactile_core.simulation.indenter_specs import MeshSpec

_DIRECTIONS = 4000  # hull points of a body: edges of 0.5 mm round then look round


def shape_of(spec: Any) -> Surface:
    """Return the nodes (n, 3) m and triangles (m, 3) of a spec's body; its own z points out of the sensor."""
    if isinstance(spec, MeshSpec):
        mesh = mesh_file.solid(mesh_file.read_bytes(spec.file), spec.file, spec.unit_mm * 1e-3, spec.up)
        return np.asarray(mesh.vertices) * 1e-3, np.asarray(mesh.faces)
    return spec.build().preview(_hull)


def _hull(support: Callable[[np.ndarray], np.ndarray]) -> Surface:
    """Return the convex hull of a body's farthest points in evenly spread directions (Fibonacci's spiral).
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
