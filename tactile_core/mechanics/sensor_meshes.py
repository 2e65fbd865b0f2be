"""Meshes of the two sensors for other tools: at rest, deformed, or with the solution of a contact."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import TactileError
from ..sensors import sensor_surface
from . import mesh_files
from .solids.hex_mesh import HexMesh, solid_mesh
from .solution import Sensor, Solution

SUFFIXES = (".ply", ".stl", ".vtu")


def check_suffix(path: str | os.PathLike) -> None:
    """Raise TactileError for a file name that says none of the formats."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise TactileError(path, f"the ending {Path(path).suffix!r}", " or ".join(SUFFIXES), "It chooses the format")


def write_rest(path: str | os.PathLike, sensor: Sensor) -> None:
    """Write the resting sensor: ``.vtu`` its volume, ``.ply`` and ``.stl`` its surface. Raises as the writers do."""
    check_suffix(path)
    if Path(path).suffix.lower() == ".vtu":
        mesh_files.write_vtu(path, solid_mesh(sensor))
    else:
        write_surface(path, sensor, np.zeros_like(sensor_surface(sensor).rest), {})


def write_solution(path: str | os.PathLike, sensor: Sensor, solution: Solution) -> None:
    """Write a solved contact.

    Of a tier that solves the volume: ``.vtu`` that volume, ``.ply`` and ``.stl`` its surface at its own nodes, with the
    force on each (N) and its von Mises stress (Pa). Of the fast tier the deformed surface, with the touching nodes.
    Raises what the writers raise.
    """
    check_suffix(path)
    volume = solution.volume
    if volume is None:
        columns = {"contact": solution.contact_patch.astype(np.float32)}
        write_surface(path, sensor, solution.displacement, columns)
        return
    solid, state = volume
    if Path(path).suffix.lower() == ".vtu":
        mesh_files.write_vtu(path, solid.mesh, solid, state)
        return
    nodes, faces = outer_surface(solid.mesh)
    moved = (solid.mesh.nodes + state.displacement)[nodes]
    if Path(path).suffix.lower() == ".stl":
        mesh_files.write_stl(path, moved, faces)
        return
    points, _ = mesh_files.solid_data(solid, state)
    mesh_files.write_ply(
        path, moved, faces, {name: points[name][nodes] for name in ("displacement", "force", "von_mises")}
    )


def outer_surface(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the touchable side's mesh nodes (n,) and triangles (m, 3), outward: eight a quadratic face."""
    faces = mesh.cells[:, 18:][np.isin(mesh.cells[:, 18:], mesh.surface).all(axis=1)].reshape(-1, 3, 3)
    quads = [faces[:, i : i + 2, j : j + 2].reshape(-1, 4) for i in (0, 1) for j in (0, 1)]
    a, b, d, c = np.concatenate(quads).T
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)  # at the skin's poles an edge is one node
    nodes, numbers = np.unique(triangles[distinct], return_inverse=True)
    return nodes, numbers.reshape(-1, 3)


def write_surface(
    path: str | os.PathLike, sensor: Sensor, displacement: np.ndarray, columns: Mapping[str, np.ndarray]
) -> None:
    """Write a sensor's surface moved by ``displacement`` (n, 3) m; ``columns`` (n,) or (n, 3) by name go along.

    PLY and STL hold the deformed places; VTU the resting ones and the displacement beside them, as VTK's own tools
    expect it. STL has no room for columns. Raises what the writers raise.
    """
    check_suffix(path)
    lattice = sensor_surface(sensor)
    suffix = Path(path).suffix.lower()
    columns = {"displacement": displacement, **columns}
    if suffix == ".stl":
        mesh_files.write_stl(path, lattice.rest + displacement, lattice.faces)
    elif suffix == ".ply":
        mesh_files.write_ply(path, lattice.rest + displacement, lattice.faces, columns)
    else:
        mesh_files.write_cells(path, lattice.rest, lattice.faces, mesh_files.TRIANGLE, columns)
