"""Meshes that show the indenters of ``tactile_core.simulation.indenter_specs``, in their own frame and in metres."""

from __future__ import annotations

from typing import Any

import bmesh
import numpy as np

from ...tactile_core.geometry.indenters import Box, BumpyCube, Indenter, Ring, Several, Sphere, mesh_file
from ...tactile_core.simulation.indenter_specs import MeshSpec

_DIRECTIONS = 4000  # hull points of a body: edges of 0.5 mm round then look round
_WIRE, _AROUND = 24, 64  # vertices across and along a ring


def shape_of(spec: Any) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3) m and triangles (m, 3) of a spec's body; its own z points out of the sensor."""
    if isinstance(spec, MeshSpec):
        mesh = mesh_file.solid(mesh_file.read_bytes(spec.file), spec.file, spec.unit_mm * 1e-3, spec.up)
        return np.asarray(mesh.vertices) * 1e-3, np.asarray(mesh.faces)
    return _shape(spec.build())


def _shape(body: Indenter) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(body, Several):
        return _joined([(pose.from_own(nodes), faces) for part, pose in body.parts for nodes, faces in [_shape(part)]])
    if isinstance(body, Ring):
        return _torus(body.radius, body.tube)
    if isinstance(body, BumpyCube):
        return _bumps(body)
    return _hull(body.support)


def _bumps(body: BumpyCube) -> tuple[np.ndarray, np.ndarray]:
    """The cube and five whole balls in it."""
    up, s = np.array([0, 0, body.bump_height]), body.spacing
    nodes, faces = _hull(Box((body.size,) * 3, body.edge).support)
    ball, ball_faces = _hull(Sphere(body.bump_radius).support)
    places = [(0, 0, 0), (s, s, 0), (s, -s, 0), (-s, s, 0), (-s, -s, 0)]
    return _joined([(nodes + up, faces), *((ball + np.array(place), ball_faces) for place in places)])


def _hull(support: Any) -> tuple[np.ndarray, np.ndarray]:
    """Convex hull of a body's farthest points in evenly spread directions (Fibonacci's spiral)."""
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


def _torus(radius: float, tube: float) -> tuple[np.ndarray, np.ndarray]:
    along = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)[:, None]
    across = np.linspace(0, 2 * np.pi, _WIRE, endpoint=False)[None, :]
    reach = radius + tube * np.cos(across)
    height = tube + tube * np.sin(across)
    nodes = np.stack(np.broadcast_arrays(reach * np.cos(along), reach * np.sin(along), height), -1)
    index = np.arange(_AROUND * _WIRE).reshape(_AROUND, _WIRE)
    a, b = index, np.roll(index, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    quads = np.stack([a, b, c, d], -1).reshape(-1, 4)
    return nodes.reshape(-1, 3), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _joined(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    starts = np.cumsum([0] + [len(nodes) for nodes, _ in parts])
    faces = [faces + start for (_, faces), start in zip(parts, starts, strict=False)]
    return np.concatenate([nodes for nodes, _ in parts]), np.concatenate(faces)
