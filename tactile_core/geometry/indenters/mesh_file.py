"""Read triangle meshes as indenters without running or fetching anything; refuse those that bound no solid.

Meshes are in mm here and wherever trimesh works on them: its tolerances are absolute, for numbers of that size.
"""

from __future__ import annotations

import io
import os
import pathlib
from typing import Any

import numpy as np

from ...errors import TactileError
from ...files import outside

FLAT = 1e-9  # over the cube of a mesh's size, largest volume that is taken for rounding (assumed)
SUFFIXES = (".stl", ".ply", ".obj", ".off")
UPS = ("x", "y", "z", "-x", "-y", "-z")
MAX_BYTES, MAX_FACES = 100_000_000, 200_000
# Words of text, bytes of binary that MAX_FACES triangles take with normals and texture; parsing takes 100 times that.
MAX_WORDS, MAX_BINARY = 20 * MAX_FACES, 32_000_000
EXTENT_MM = (0.2, 100.0)  # an indenter for a fingertip; outside of it the unit is wrong (assumed)
_UNITS = {"metres": 1.0, "inches": 0.0254, "centimetres": 1e-2, "millimetres": 1e-3, "micrometres": 1e-6}
_ROUNDING = 1e-5  # of the largest coordinate: twice what six digits of text round off
_LARGEST_GAP = 1e-4  # of the body's size, which bounds the above for coordinates far from zero (assumed)
_WELDED = 8  # most vertices that one is united with directly; chains reach further
_LOWEST_MM = 1e-4  # vertices this near to the lowest one belong to one flat


def read_bytes(path: str | os.PathLike) -> bytes:
    """Read a mesh file. Raises TactileError for an unknown kind of file, and for one that cannot be read."""
    path = pathlib.Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise TactileError(path, f"a {path.suffix or 'nameless'} file", f"a triangle mesh: {', '.join(SUFFIXES)}")
    try:
        with outside.open_file(path, "a triangle mesh") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise TactileError(path, f"cannot be read ({error.strerror})", "a triangle mesh") from error
    if len(content) > MAX_BYTES:
        raise TactileError(path, f"more than {MAX_BYTES // 10**6} MB", f"at most {MAX_FACES} triangles", "Simplify it")
    return content


def solid(content: bytes, where: str | os.PathLike, scale: float, up: str) -> Any:
    """Return the mesh (a trimesh, mm) in an indenter's own frame: its lowest flat or point touches z = 0 at the origin.

    content : of the file; where : the file, for its suffix and for messages; scale : m per unit of the file
    up : the file's axis, x, y, z, -x, -y or -z, that points out of the sensor
    Raises TactileError unless it is closed, wound outward, and has the size of an indenter. Whether it crosses itself
    is checked only when its grid is built."""
    vertices, faces = _parsed(content, pathlib.Path(where))
    mesh = closed_mesh(vertices @ _turn(up).T, faces, where, scale)
    low = mesh.vertices[mesh.vertices[:, 2] < mesh.vertices[:, 2].min() + _LOWEST_MM]
    middle = (low.min(axis=0) + low.max(axis=0)) / 2
    mesh.apply_translation(-np.array([*middle[:2], low[:, 2].min()]))
    return mesh


def closed_mesh(vertices: np.ndarray, faces: np.ndarray, where: str | os.PathLike, scale: float) -> Any:
    """Return the solid (a trimesh, mm) of vertices (n, 3) and faces (m, 3), not moved; vertices that coincide become
    one. where : names the mesh in messages; scale : m per unit of the vertices
    Raises TactileError for a mesh that is too large, too small, or not closed."""
    import trimesh

    check_size(where, np.ptp(vertices, axis=0).max(), scale)
    mesh = trimesh.Trimesh(vertices * (scale * 1e3), faces, process=False)
    mesh.merge_vertices()
    if not mesh.is_watertight:
        mesh = trimesh.Trimesh(*_welded(mesh.vertices, mesh.faces), process=False)
    corners = np.sort(mesh.faces, axis=1)
    mesh.update_faces((corners[:, 0] < corners[:, 1]) & (corners[:, 1] < corners[:, 2]))
    mesh.remove_unreferenced_vertices()
    _check_solid(where, mesh)
    return mesh


def _welded(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unite vertices (n, 3) that differ by rounding alone; return those that are left, and the faces (m, 3) by them."""
    import scipy.sparse
    import scipy.spatial

    within = min(_ROUNDING * np.abs(vertices).max(), _LARGEST_GAP * np.ptp(vertices, axis=0).max())
    tree = scipy.spatial.cKDTree(vertices)
    near = tree.query(vertices, min(_WELDED, tree.n), distance_upper_bound=within)[1].reshape(tree.n, -1)
    one, other = np.nonzero(near < tree.n)
    graph = scipy.sparse.coo_array((np.ones(len(one)), (one, near[one, other])), (tree.n, tree.n))
    label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    return vertices[np.unique(label, return_index=True)[1]], label[faces]


def _parsed(content: bytes, path: pathlib.Path) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3), in the file's unit, and faces (m, 3). Raises TactileError for a damaged file."""
    import trimesh

    _check_length(content, path)
    _check_whole(content, path)
    options = {"skip_materials": True} if path.suffix.lower() == ".obj" else {}
    try:  # from memory: neither materials nor textures that the file names are looked up
        mesh = trimesh.load_mesh(io.BytesIO(content), file_type=path.suffix[1:].lower(), process=False, **options)
        vertices, faces = np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
    except Exception as error:  # a damaged file fails wherever its parser happens to be
        raise TactileError(path, f"cannot be read as a mesh ({error})", "a triangle mesh") from error
    check_triangles(path, vertices, faces)
    used = np.bincount(faces.ravel(), minlength=len(vertices)) > 0
    return vertices[used], (np.cumsum(used) - 1)[faces]


def _check_whole(content: bytes, path: pathlib.Path) -> None:
    """Raise TactileError for a binary STL shorter than it declares, which trimesh would take for text."""
    if path.suffix.lower() != ".stl" or b"\0" not in content[:84]:  # text has no zero byte
        return
    count = int.from_bytes(content[80:84], "little")
    if len(content) < 84 + 50 * count or len(content) < 84:
        found = f"cut short: {len(content)} bytes for {count:,} triangles"
        raise TactileError(path, found, f"{84 + 50 * count:,} bytes", "Copy or export it again")


def check_triangles(where: str | os.PathLike, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Raise TactileError unless vertices (n, 3) and faces (m, 3) are 1 to MAX_FACES triangles, all coordinates finite.
    where : names the mesh in messages"""
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        found = f"vertices {vertices.shape}, faces {faces.shape}"
        raise TactileError(where, found, "three coordinates, three corners")
    if not len(faces):
        raise TactileError(where, "no triangles", "a triangle mesh")
    if len(faces) > MAX_FACES:
        raise TactileError(where, f"{len(faces)} triangles", f"at most {MAX_FACES}", "Simplify it")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise TactileError(where, "triangles of missing vertices", "a triangle mesh")
    if not np.isfinite(vertices[faces]).all():
        raise TactileError(where, "a coordinate is nan or infinite", "finite coordinates")


def _check_length(content: bytes, path: pathlib.Path) -> None:
    """Raise TactileError, before parsing, for a file of far more than MAX_FACES triangles."""
    words = sum(content.count(mark) for mark in b" \t\r\n")
    if words > MAX_WORDS or (b"\0" in content and len(content) > MAX_BINARY):
        raise TactileError(path, f"{len(content) / 1e6:.0f} MB", f"at most {MAX_FACES} triangles", "Simplify it")


def check_size(where: str | os.PathLike, extent: float, scale: float) -> None:
    """Raise TactileError for a body whose largest extent, in units of ``scale`` m, is not 0.2 to 100 mm.
    where : names the mesh in the message"""
    smallest, largest = EXTENT_MM
    if smallest <= extent * scale * 1e3 <= largest:
        return
    fitting = [f"{name} (unit_mm = {unit * 1e3:g})" for name, unit in _UNITS.items() if 1 <= extent * unit * 1e3 <= 50]
    advice = f"The file seems to be in {' or '.join(fitting)}" if fitting else "Scale it to the size of an indenter"
    found = f"{extent * scale * 1e3:.4g} mm across with unit_mm = {scale * 1e3:g}"
    raise TactileError(where, found, f"{smallest:g} to {largest:g} mm", advice)


def _turn(up: str) -> np.ndarray:
    """Return the rotation (3, 3) that takes the file's axis ``up`` to z."""
    turn = np.roll(np.eye(3), 2 - "xyz".index(up[-1]), axis=0)
    return turn * [[-1], [1], [-1]] if up[0] == "-" else turn


def _check_solid(where: str | os.PathLike, mesh: Any) -> None:
    if not mesh.is_watertight:
        sides = np.sort(mesh.edges, axis=1)
        count = np.unique(sides, axis=0, return_counts=True)[1]
        found = f"not closed: {(count != 2).sum()} edges do not belong to exactly two triangles"
        advice = "Fill its holes, for example in Blender's 3D-Print Toolbox"
        raise TactileError(where, found, "a closed surface", advice)
    if not mesh.is_winding_consistent:
        raise TactileError(where, "neighbouring triangles face opposite ways", "one winding", "Recalculate its normals")
    with np.errstate(invalid="ignore", divide="ignore"):  # the centre of mass of nothing, which is not used
        volume = mesh.volume
    if abs(volume) <= FLAT * mesh.scale**3:
        raise TactileError(where, "flat: it encloses nothing", "a solid body", "Give it a thickness")
    if not volume > 0:
        raise TactileError(where, "it is inside out: its volume is negative", "outward normals", "Flip its normals")
