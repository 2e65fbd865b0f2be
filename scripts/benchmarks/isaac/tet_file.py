"""Tetrahedral meshes in the text layout of Isaac Gym: lines ``v x y z`` and ``t a b c d``, ``#`` starts a comment."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np

from tactile_core.errors import TactileError

THINNEST = 1e-6  # volume of a cell over its longest edge's cube; below that it is flat (a regular one: 0.118)


@dataclasses.dataclass(frozen=True)
class TetMesh:
    """A solid of linear tetrahedra.

    nodes : (n, 3) float64, m
    cells : (n_cells, 4) int, all of positive volume
    """

    nodes: np.ndarray
    cells: np.ndarray

    @property
    def surface(self) -> np.ndarray:
        """Triangles (n_faces, 3) int of the boundary, normals outward."""
        faces = self.cells[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return faces[np.sort(first[count == 1])]


def read_tet(path: str | os.PathLike) -> TetMesh:
    """Read the mesh of a ``.tet`` file in metres; numbers after the third of a vertex are passed over.

    Raises TactileError, naming the line where there is one, for a file that is unreadable or holds flat cells.
    """
    nodes: list[list[float]] = []
    cells: list[list[int]] = []
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise TactileError(path, f"cannot be read ({error})", "a .tet file in Isaac Gym's text layout") from error
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].split()
        try:
            if words[:1] == ["v"] and 4 <= len(words) <= 5:
                nodes.append([float(word) for word in words[1:4]])
            elif words[:1] == ["t"] and len(words) == 5:
                cells.append([int(word) for word in words[1:]])
            elif words:
                raise ValueError
        except ValueError:
            expected = "`v x y z` or `t a b c d`"
            raise TactileError(f"{path}, line {number}", repr(line[:40]), expected) from None
    return checked(np.array(nodes), np.array(cells), path)


def checked(nodes: np.ndarray, cells: np.ndarray, where: str | os.PathLike = "tetrahedra") -> TetMesh:
    """Make a mesh of nodes (n, 3) m and cells (n_cells, 4), inverted ones turned. Raises TactileError for flat ones."""
    corners = nodes[cells]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max((1, 2))
    flat = np.abs(volume) < THINNEST * longest**3
    if flat.any():
        found = f"{int(flat.sum())} tetrahedra without volume, the first is number {int(np.argmax(flat))}"
        raise TactileError(where, found, "solid tetrahedra", "Make the mesh again")
    return TetMesh(nodes, np.where((volume < 0)[:, None], cells[:, [0, 2, 1, 3]], cells))
