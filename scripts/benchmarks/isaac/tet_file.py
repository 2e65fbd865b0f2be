"""Tetrahedral meshes in the text layout of Isaac Gym: lines ``v x y z`` and ``t a b c d``, ``#`` starts a comment."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path

import numpy as np

from tactile_core.errors import TactileError
from tactile_core.files import outside

MAX_CELLS = 100_000  # the public BioTac mesh holds 15,410; a solve of 100,000 takes minutes and gigabytes
MAX_BYTES = 16 * 2**20  # assumed: three times what MAX_CELLS cells take; its lines take 200 MB at most
SIZES = 1e-3, 0.2  # m, least and largest extent of a fingertip's mesh (assumed): one in millimetres is larger
THINNEST = 1e-6  # volume of a cell over its longest edge's cube; below that it is flat (a regular one: 0.118)
# What exporters write before the lists (Isaac Gym's own does); a file that was cut short holds less.
_PROMISE = re.compile(r"#\s*(\d+)\s+(vertices|tetrahedra)\s*$")


@dataclasses.dataclass(frozen=True)
class TetMesh:
    """A solid of linear tetrahedra.

    nodes : (n, 3) float64, m
    cells : (n_cells, 4) int, all of positive volume
    turned : how many cells of the file were inside out; two of their corners were exchanged
    """

    nodes: np.ndarray
    cells: np.ndarray
    turned: int = 0

    @property
    def surface(self) -> np.ndarray:
        """Triangles (n_faces, 3) int of the boundary, normals outward."""
        faces = self.cells[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return faces[np.sort(first[count == 1])]


def read_tet(path: str | os.PathLike) -> TetMesh:
    """The mesh of a ``.tet`` file in metres; numbers after the third of a vertex are passed over, as Isaac Gym does.

    Cells that are inside out are turned and counted. Raises TactileError, naming the line where there is one, for a
    file that is unreadable, cut short, too large, not finite, in millimetres, or holds doubled, flat or loose parts.
    """
    path = Path(path)
    nodes, cells, promised = _parse(path, _lines(path))
    for found, word in ((nodes, "vertices"), (cells, "tetrahedra")):
        if not found:
            raise TactileError(path, f"no {word}", "lines `v x y z` and `t a b c d`", "Name a .tet file of Isaac Gym")
        if promised.get(word, len(found)) != len(found):
            expected = f"the {promised[word]} that its comment promises"
            raise TactileError(path, f"{len(found)} {word}", expected, "The file is cut short: fetch it again")
    return checked(np.array(nodes), np.array(cells), path)


def checked(nodes: np.ndarray, cells: np.ndarray, where: str | os.PathLike = "tetrahedra") -> TetMesh:
    """A mesh of nodes (n, 3) m and cells (n_cells, 4) that can be computed with. Raises what ``read_tet`` raises."""
    _check_nodes(where, nodes)
    _check_cells(where, cells, len(nodes))
    corners = nodes[cells]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.linalg.det(edges) / 6
    longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max((1, 2))
    flat = np.abs(volume) < THINNEST * longest**3
    if flat.any():
        found = f"{int(flat.sum())} tetrahedra without volume, the first is number {int(np.argmax(flat))}"
        raise TactileError(where, found, "solid tetrahedra", "Make the mesh again")
    cells = np.where((volume < 0)[:, None], cells[:, [0, 2, 1, 3]], cells)
    return TetMesh(nodes, cells, int((volume < 0).sum()))


def _lines(path: Path) -> list[str]:
    try:
        return outside.read(path, MAX_BYTES, "a .tet file").decode().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise TactileError(path, f"cannot be read ({error})", "a .tet file in Isaac Gym's text layout") from error


def _parse(path: Path, lines: list[str]) -> tuple[list[list[float]], list[list[int]], dict[str, int]]:
    """Vertices, tetrahedra, and the counts that comments promise."""
    nodes, cells, promised = [], [], {}
    for number, line in enumerate(lines, 1):
        promise = _PROMISE.match(line)
        if promise:
            promised[promise[2]] = int(promise[1])
        words = line.partition("#")[0].split()
        try:
            if not words:
                continue
            if words[0] == "v" and 4 <= len(words) <= 5:
                nodes.append([float(word) for word in words[1:4]])
            elif words[0] == "t" and len(words) == 5:
                cells.append([int(word) for word in words[1:]])
            else:
                raise ValueError
        except ValueError:
            expected = "`v x y z` or `t a b c d`"
            advice = "The file may be cut short: fetch it again" if number == len(lines) else ""
            raise TactileError(f"{path}, line {number}", repr(line[:40]), expected, advice) from None
        for found, word in ((nodes, "vertices"), (cells, "tetrahedra")):
            if len(found) > MAX_CELLS:
                raise TactileError(path, f"more than {MAX_CELLS} {word}", f"at most {MAX_CELLS}", "Coarsen the mesh")
    return nodes, cells, promised


def _check_nodes(where: str | os.PathLike, nodes: np.ndarray) -> None:
    bad = ~np.isfinite(nodes).all(1)
    if bad.any():
        raise TactileError(where, f"vertex {int(np.argmax(bad))} is nan or infinite", "finite numbers")
    size = float(np.ptp(nodes, axis=0).max())
    if not SIZES[0] <= size <= SIZES[1]:
        found = f"a mesh {size:.3g} m long"
        advice = "It looks like millimetres: divide its vertices by 1000" if size > SIZES[1] else "Scale it to metres"
        raise TactileError(where, found, f"metres, {SIZES[0]:g} to {SIZES[1]:g} long", advice)
    order = np.lexsort(nodes.T)
    same = (nodes[order[1:]] == nodes[order[:-1]]).all(1)
    if same.any():
        a, b = sorted(order[int(np.argmax(same)) + np.arange(2)].tolist())
        raise TactileError(where, f"vertices {a} and {b} are at one place", "a vertex at each place", "Merge them")


def _check_cells(where: str | os.PathLike, cells: np.ndarray, count: int) -> None:
    outside = ((cells < 0) | (cells >= count)).any(1)
    if outside.any():
        k = int(np.argmax(outside))
        found = f"tetrahedron {k} names the vertices {cells[k].tolist()}"
        raise TactileError(where, found, f"numbers 0 to {count - 1}", "The file may be cut short")
    ordered = np.sort(cells, axis=1)
    twice = (ordered[:, 1:] == ordered[:, :-1]).any(1)
    if twice.any():
        k = int(np.argmax(twice))
        raise TactileError(where, f"tetrahedron {k} names a vertex twice: {cells[k].tolist()}", "four vertices")
    _, first, number = np.unique(ordered, axis=0, return_index=True, return_counts=True)
    if (number > 1).any():
        k = int(first[number > 1].min())
        raise TactileError(where, f"tetrahedron {k} is there twice", "each once", "Remove one of them")
    loose = np.setdiff1d(np.arange(count), cells)
    if len(loose):
        found = f"{len(loose)} vertices belong to no tetrahedron, the first is {int(loose[0])}"
        raise TactileError(where, found, "vertices of the solid alone", "Remove them")
