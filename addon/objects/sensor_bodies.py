"""Add bodies round the sensors' surfaces, as their children: parts of ``sensor_bodies.toml``, each a stack of rings."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...tactile_core import sensors
from ...tactile_core.geometry.lattice import cap_faces, grid_faces
from ...tactile_core.pictures.mitsuba.window import ACRYLIC
from ..settings import properties
from . import digit_materials, surfaces

_ANY_GEL = "gel"  # the table of gels without one of their own
_ROUND = 32  # points of a circle
_MM = 1e3


def add_parts(thing: bpy.types.Object) -> None:
    """Add a sensor's parts by ``sensor_bodies.toml``, and a gel's acrylic window, as children of its surface."""
    sensor = properties.sensor_name(thing)
    known = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    is_gel = thing.tactile.role == "DIGIT"
    border = _border(sensor) if is_gel else np.empty((0, 3))
    for part in known.get(sensor, known[_ANY_GEL] if is_gel else []):
        meshes = [stack(part, middle, border) for middle in part.get("at", [[0.0, 0.0]])]
        counts = np.cumsum([0] + [len(nodes) for nodes, _ in meshes])
        faces = np.concatenate([faces + before for (_, faces), before in zip(meshes, counts, strict=False)])
        material = digit_materials.of_body(part["material"], **known["materials"][part["material"]])
        nodes = np.concatenate([nodes for nodes, _ in meshes])
        _add(thing, part["name"], (nodes, faces), material)
    if is_gel:
        back = -_MM * sensors.shape_of(sensor).back_y
        window = {"outline": "gel", "rows": [[back - _MM * ACRYLIC, -0.05], [back, -0.05]]}
        _add(thing, "acrylic", stack(window, [0.0, 0.0], border), digit_materials.acrylic())


def stack(part: dict[str, Any], middle: list[float], border: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Build one part, a stack of rings: nodes (n, 3) mm in its sensor object's axes, triangles (m, 3), outward.

    part : a table of ``sensor_bodies.toml``; middle : (2,) mm of its outline
    border : (k, 3) mm, outline of the gel's surface; (0, 3) for other sensors
    """
    shape, rows = part["outline"], [(*row, 0.0)[:3] for row in part["rows"]]
    outline = border[:, :2] if isinstance(shape, str) else _rectangle(*shape) + middle
    base = border[:, 2] if shape == "border" else np.zeros(len(outline))
    tangent = np.roll(outline, -1, axis=0) - np.roll(outline, 1, axis=0)
    outward = np.stack([tangent[:, 1], -tangent[:, 0]], -1) / np.linalg.norm(tangent, axis=1, keepdims=True)
    along_x = part.get("axis") == "x"
    rings = []
    for height, grown, shift in rows:
        flat = outline + grown * outward + [0.0, shift]
        level = (base + height)[:, None]
        rings.append(np.hstack([level, flat] if along_x else [flat, level]))
    count, loop, nodes = len(outline), bool(part.get("loop")), np.concatenate(rings)
    faces = [grid_faces(len(rings) + loop, count, closed=True) % len(nodes)]
    if not loop:
        first, last = np.arange(count), len(nodes) - 1 - np.arange(count)
        faces += [cap_faces(len(nodes), first), cap_faces(len(nodes) + 1, last)]
        nodes = np.concatenate([nodes, [rings[0].mean(0), rings[-1].mean(0)]])
    triangles = np.concatenate(faces)
    a, b, c = nodes[triangles].transpose(1, 0, 2)
    inward = (a * np.cross(b, c)).sum() < 0  # as the rows go up or down
    return nodes, triangles[:, ::-1] if inward else triangles


def _rectangle(half: float, other: float | None = None, corner: float | None = None) -> np.ndarray:
    """Return the outline (n, 2) mm, counter-clockwise, of a rectangle of half sides ``half``, ``other`` whose corners
    are round by the radius ``corner``; of ``half`` alone a circle."""
    other, corner = half if other is None else other, half if corner is None else corner
    turn = (np.arange(_ROUND) + 0.5) * 2 * np.pi / _ROUND
    way = np.stack([np.cos(turn), np.sin(turn)], -1)
    return np.sign(way) * (np.array([half, other]) - corner) + corner * way


def _border(sensor: str) -> np.ndarray:
    """Return the border (n, 3) mm of a gel's surface at rest, in its object's axes, counter-clockwise from above."""
    surface = sensors.sensor_surface(sensor)
    grid = surface.grid(surface.rest)[..., [0, 2, 1]] * [_MM, _MM, -_MM]
    return np.concatenate([grid[::-1, -1], grid[0, -2::-1], grid[1:, 0], grid[-1, 1:-1]])


def _add(thing: bpy.types.Object, name: str, mesh: tuple[np.ndarray, np.ndarray], material: bpy.types.Material) -> None:
    (nodes, faces), title = mesh, sensors.title(properties.sensor_name(thing))
    made = surfaces.new_mesh_object(f"{title} {name}", nodes * thing.tactile.per_metre / _MM, faces, smooth=False)
    properties.set_up_part(made, thing, "BODY")
    made.hide_select = True
    made.data.materials.append(material)
    made.color = material.diffuse_color
