"""Write meshes of the two sensors for other tools: at rest, deformed, or with the solution of a contact."""

from __future__ import annotations

import base64
import os
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import TactileError
from ..files import atomic
from ..sensors import sensor_surface
from ..sensors.unrolling import node_normals
from .solids import stress
from .solids.finite_strain import FiniteStrainSolid, State
from .solids.hex_mesh import HexMesh, outer_faces, solid_mesh
from .solution import Sensor, Solution

Data = Mapping[str, np.ndarray]
TRIANGLE, TRIQUADRATIC_HEXAHEDRON = 5, 29  # cell types of VTK
_VTK_NAMES = {"float32": "Float32", "float64": "Float64", "int32": "Int32", "int64": "Int64", "uint8": "UInt8"}


def vtk_order() -> np.ndarray:
    """Return the node (27,) of a ``HexMesh`` cell, as a + 3 b + 9 c, at each place of VTK's triquadratic hexahedron.
    VTK counts corners, edges (of the bottom, of the top, then the upright ones), faces -x +x -y +y -z +z and the
    middle; bottom corners before top ones: Schroeder, Martin, Lorensen, The Visualization Toolkit,
    vtkTriQuadraticHexahedron."""
    square = [(0, 0), (2, 0), (2, 2), (0, 2)]
    sides = [(1, 0), (2, 1), (1, 2), (0, 1)]
    places = [(a, b, c) for c in (0, 2) for a, b in square]
    places += [(a, b, c) for c in (0, 2) for a, b in sides] + [(a, b, 1) for a, b in square]
    places += [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2), (1, 1, 1)]
    a, b, c = np.array(places).T
    return a + 3 * b + 9 * c


def write_ply(path: str | os.PathLike, nodes: np.ndarray, faces: np.ndarray, columns: Data | None = None) -> None:
    """Write a surface with outward unit normals, binary PLY: float32 x y z nx ny nz, then ``columns``.

    nodes : (n, 3) m; faces : (m, 3) int, triangles, normals outward
    columns : values (n,) or (n, 3) by name, written as float32; a vector ``force`` becomes force_x force_y force_z
    Raises TactileError for values of another length or not finite, and if the file cannot be written.
    """
    vertex = {"": nodes, "n": node_normals(nodes, faces)} | dict(columns or {})
    fields = {}
    for name, values in vertex.items():
        values = _checked(path, name or "nodes", values, len(nodes))
        if values.ndim == 1:
            fields[name] = values
        else:
            stem = f"{name}_" if len(name) > 1 else name
            fields |= {stem + axis: values[:, k] for k, axis in enumerate("xyz")}
    head = ["ply", "format binary_little_endian 1.0", "comment tactile-core, metres and newtons"]
    head += [f"element vertex {len(nodes)}", *(f"property float {name}" for name in fields)]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    triangles = np.zeros(len(faces), [("count", "u1"), ("nodes", "<i4", 3)])
    triangles["count"], triangles["nodes"] = 3, faces
    rows = np.column_stack(list(fields.values())).astype("<f4")
    _write(path, ("\n".join(head) + "\n").encode() + rows.tobytes() + triangles.tobytes())


def write_stl(path: str | os.PathLike, nodes: np.ndarray, faces: np.ndarray) -> None:
    """Write a surface as binary STL: triangles and their unit normals, float32.
    nodes : (n, 3) m; faces : (m, 3) int, outward
    Raises what ``write_ply`` raises."""
    corners = _checked(path, "nodes", nodes, len(nodes))[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    rows = np.zeros(len(faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["normal"], rows["corners"] = normal, corners
    _write(path, b"tactile-core, metres".ljust(80) + struct.pack("<I", len(faces)) + rows.tobytes())


def write_vtu(
    path: str | os.PathLike, mesh: HexMesh, solid: FiniteStrainSolid | None = None, state: State | None = None
) -> None:
    """Write a volume of triquadratic hexahedra at rest or, given both ``solid`` and ``state``, as solved.
    Points have ``clamped`` (0 or 1) and, if solved, ``displacement`` m (in ParaView: Warp By Vector), ``force`` N that
    the outside exerts on each node (contact, fluid, support), ``stress`` Pa (Cauchy, xx yy zz xy yz xz) and its
    ``von_mises`` Pa, smoothed by ``stress.at_nodes``. Cells have ``von_mises``, mean over their volume, and
    ``pressure`` Pa in their middle, compression positive.
    Raises what ``write_ply`` raises, and FloatingPointError for a state with a cell turned inside out."""
    point_data: Data = {"clamped": mesh.clamped.astype(np.uint8)}
    cell_data: Data = {}
    if solid is not None and state is not None:
        points, cell_data = solid_data(solid, state)
        point_data = {**point_data, **points}
    write_cells(path, mesh.nodes, mesh.cells[:, vtk_order()], TRIQUADRATIC_HEXAHEDRON, point_data, cell_data)


def solid_data(solid: FiniteStrainSolid, state: State) -> tuple[Data, Data]:
    """Return data of a solved state: at points displacement, force, stress, von_mises; in cells von_mises, pressure."""
    cauchy = stress.cauchy(solid, state)
    at_nodes = stress.at_nodes(solid, cauchy)
    six = [at_nodes[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))]
    mean = (stress.von_mises(cauchy) * solid.weight).sum(1) / solid.weight.sum(1)
    points = {
        "displacement": state.displacement, "force": stress.nodal_force(solid, state),
        "stress": np.column_stack(six), "von_mises": stress.von_mises(at_nodes),
    }  # fmt: skip
    return points, {"von_mises": mean, "pressure": -state.pressure[:, 0]}


def write_cells(
    path: str | os.PathLike,
    nodes: np.ndarray,
    cells: np.ndarray,
    kind: int,
    point_data: Data | None = None,
    cell_data: Data | None = None,
) -> None:
    """Write cells of one kind as VTK's XML unstructured grid, base64 inside.

    nodes : (n, 3) m; cells : (m, k) int in VTK's order; kind : number of VTK's cell type, 5 for triangles
    point_data, cell_data : values (n or m,) or (n or m, k) by name; floats become float32
    Raises what ``write_ply`` raises.
    """
    offsets = cells.shape[1] * np.arange(1, len(cells) + 1, dtype=np.int64)
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f'<UnstructuredGrid><Piece NumberOfPoints="{len(nodes)}" NumberOfCells="{len(cells)}">',
        "<Points>", _array("Points", _checked(path, "nodes", nodes, len(nodes)).astype(np.float64)), "</Points>",
        "<Cells>", _array("connectivity", cells.astype(np.int64).ravel()), _array("offsets", offsets),
        _array("types", np.full(len(cells), kind, np.uint8)), "</Cells>",
    ]  # fmt: skip
    for tag, data, count in (("PointData", point_data, len(nodes)), ("CellData", cell_data, len(cells))):
        values = {name: _checked(path, name, given, count) for name, given in (data or {}).items()}
        lines += [f"<{tag}>", *(_array(name, given) for name, given in values.items()), f"</{tag}>"]
    lines += ["</Piece></UnstructuredGrid>", "</VTKFile>", ""]
    _write(path, "\n".join(lines).encode())


def _array(name: str, values: np.ndarray) -> str:
    """Format values (n,) or (n, k) as one DataArray: base64 of their number of bytes and themselves, as VTK wants."""
    little = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes()
    text = base64.b64encode(struct.pack("<Q", len(little)) + little).decode()
    width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
    return f'<DataArray type="{_VTK_NAMES[values.dtype.name]}" Name="{name}"{width} format="binary">{text}</DataArray>'


def _checked(path: str | os.PathLike, name: str, values: np.ndarray, count: int) -> np.ndarray:
    """Return values (count, ...) to write, floats but for nodes as float32; TactileError for other shapes or NaN."""
    values = np.asarray(values)
    if len(values) != count or values.ndim > 2:
        raise TactileError(path, f"{name} of shape {values.shape}", f"{count} rows")
    if values.dtype.kind == "f":
        if not np.isfinite(values).all():
            raise TactileError(path, f"{name} holds nan or infinity", "finite values")
        return values if name == "nodes" else values.astype(np.float32)
    return values.astype(np.uint8 if values.dtype.kind == "b" else values.dtype)


def _write(path: str | os.PathLike, content: bytes) -> None:
    with atomic.writing(path, "a place in a writable folder with room", ""):
        atomic.write_bytes(path, content)


SUFFIXES = (".ply", ".stl", ".vtu")


def check_suffix(path: str | os.PathLike) -> None:
    """Raise TactileError unless a file name ends in .ply, .stl or .vtu, in capitals or not."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise TactileError(path, f"the ending {Path(path).suffix!r}", " or ".join(SUFFIXES), "It chooses the format")


def write_rest(path: str | os.PathLike, sensor: Sensor) -> None:
    """Write the resting sensor: its volume to ``.vtu``, its surface to ``.ply`` or ``.stl``. Raises what writers do."""
    if Path(path).suffix.lower() == ".vtu":
        write_vtu(path, solid_mesh(sensor))
    else:
        write_surface(path, sensor, np.zeros_like(sensor_surface(sensor).rest), {})


def write_solution(path: str | os.PathLike, sensor: Sensor, solution: Solution) -> None:
    """Write a solved contact on a sensor, in the format that the ending of ``path`` says.

    A tier that solves the volume: ``.vtu`` that volume; ``.ply`` and ``.stl`` its surface at its own nodes, with the
    force on each (N) and its von Mises stress (Pa). The fast tier: the deformed surface, ``contact`` 1 where touched.
    Raises what the writers raise."""
    check_suffix(path)
    if solution.volume is None:
        contact = solution.contact_patch.astype(np.float32)
        write_surface(path, sensor, solution.displacement, {"contact": contact})
        return
    solid, state = solution.volume
    if Path(path).suffix.lower() == ".vtu":
        write_vtu(path, solid.mesh, solid, state)
        return
    nodes, faces = outer_surface(solid.mesh)
    points, _ = solid_data(solid, state)
    columns = {name: points[name][nodes] for name in ("displacement", "force", "von_mises")}
    _write_triangles(path, (solid.mesh.nodes + state.displacement)[nodes], faces, columns)


def outer_surface(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh nodes (n,) of the side that is touched, ascending, and outward triangles (m, 3) of positions in
    that list: eight per quadratic face, fewer if one of its edges is a single node."""
    faces = outer_faces(mesh).reshape(-1, 3, 3)
    quads = [faces[:, i : i + 2, j : j + 2].reshape(-1, 4) for i in (0, 1) for j in (0, 1)]
    a, b, d, c = np.concatenate(quads).T
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)  # at the skin's poles an edge is one node
    nodes, numbers = np.unique(triangles[distinct], return_inverse=True)
    return nodes, numbers.reshape(-1, 3)


def write_surface(
    path: str | os.PathLike, sensor: Sensor, displacement: np.ndarray, columns: Mapping[str, np.ndarray]
) -> None:
    """Write a sensor's surface moved by ``displacement`` (n, 3) m, in the format that the ending of ``path`` says, with
    that displacement and ``columns``, (n,) or (n, 3) by name.
    PLY and STL hold deformed places; VTU holds the resting ones and the displacement beside them, as VTK's tools
    expect. STL has no room for columns. Raises what the writers raise."""
    check_suffix(path)
    lattice = sensor_surface(sensor)
    columns = {"displacement": displacement, **columns}
    if Path(path).suffix.lower() == ".vtu":
        write_cells(path, lattice.rest, lattice.faces, TRIANGLE, columns)
    else:
        _write_triangles(path, lattice.rest + displacement, lattice.faces, columns)


def _write_triangles(path: str | os.PathLike, nodes: np.ndarray, faces: np.ndarray, columns: Data) -> None:
    """Write a surface of nodes, faces, columns as in ``write_ply``: as PLY or, without columns, as STL, by ``path``."""
    if Path(path).suffix.lower() == ".stl":
        write_stl(path, nodes, faces)
    else:
        write_ply(path, nodes, faces, columns)
