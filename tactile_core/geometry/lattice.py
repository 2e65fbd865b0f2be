"""A structured sensor surface: nodes on a grid of two parameters, and its triangles."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from typing import TYPE_CHECKING

import numpy as np

from .cubic_spline import EvenSpline


@dataclasses.dataclass(frozen=True)
class Lattice:
    """A surface whose nodes lie on a (rows, columns) grid.

    rest : (n_nodes, 3) float64, m, the undeformed surface in the shared frame of ``sensors``
    faces : (n_faces, 3) int32, triangles, normals outward
    shape : (rows, columns), node index = row * columns + column; the poles of a surface that closes at its ends come
        after the grid (tip pole first, base pole last)
    window : slices of rows and columns in which x depends on the row alone and z on the column alone, both evenly
        spaced; None without such a part
    """

    rest: np.ndarray
    faces: np.ndarray
    shape: tuple[int, int]
    window: tuple[slice, slice] | None = None

    def __post_init__(self) -> None:
        self.rest.flags.writeable = False
        self.faces.flags.writeable = False

    @property
    def closed(self) -> bool:
        """Return true if the last column joins the first: a surface with poles closes round its axis."""
        return len(self.rest) > self.shape[0] * self.shape[1]

    @property
    def sha256(self) -> str:
        """Hash of the rest nodes rounded to 1 nm, so that two builds agree; files identify the surface by it."""
        rounded = np.round(self.rest * 1e9).astype("<i8")
        return hashlib.sha256(rounded.tobytes()).hexdigest()

    @functools.cached_property
    def blocks(self) -> LatticeBlocks:
        """Return the search index for resting nodes near an indenter."""
        return LatticeBlocks(self.rest, self.shape)

    @functools.cached_property
    def axes(self) -> np.ndarray:
        """Coordinates x, y, z (3, rows, columns) m of the grid's resting nodes, poles left out."""
        return np.ascontiguousarray(np.moveaxis(self.grid(self.rest), 2, 0))

    @functools.cached_property
    def window_rest(self) -> np.ndarray:
        """Resting nodes (rows, columns, 3) m of the window; for surfaces that have one."""
        return self.grid(self.rest)[self.window]

    @functools.cached_property
    def window_axes(self) -> tuple[EvenSpline, EvenSpline]:
        """Splines through the window's nodes: of x, m, over the row, and of z, m, over the column."""
        return EvenSpline.through(self.window_rest[:, 0, 0]), EvenSpline.through(self.window_rest[0, :, 2])

    def grid(self, values: np.ndarray) -> np.ndarray:
        """Return ``values`` at nodes (..., n_nodes, k) as a grid (..., rows, columns, k); poles left out."""
        rows, columns = self.shape
        values = np.asarray(values)
        return values[..., : rows * columns, :].reshape(*values.shape[:-2], rows, columns, values.shape[-1])


def grid_faces(rows: int, columns: int, *, closed: bool) -> np.ndarray:
    """Return the triangles (n, 3) int32 of a grid, two per cell, nodes counted row by row. They point along the cross
    product of a step to the next row with one to the next column. closed : true if the last column joins the first"""
    row = np.arange(rows - 1)[:, None]
    column = np.arange(columns if closed else columns - 1)[None, :]
    right = (column + 1) % columns
    a, b = row * columns + column, (row + 1) * columns + column
    c, d = (row + 1) * columns + right, row * columns + right
    quads = np.stack([a, b, c, d], -1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)


def cap_faces(pole: int, ring: np.ndarray) -> np.ndarray:
    """Return a fan of triangles (n, 3) int32 between a node, ``pole``, and a closed ring (n,) of nodes, by number."""
    return np.stack([np.full(len(ring), pole), ring, np.roll(ring, -1)], -1).astype(np.int32)


if TYPE_CHECKING:
    from .indenters import Indenter, Pose

_SIDE = 6  # nodes along a block's side: the quickest search
_STEEPEST = 1.1  # largest slope of a distance: 1, and a little more for a mesh's spline (assumed)


class LatticeBlocks:
    """Search index of nodes ``rest`` (n, 3) m: blocks of 6 x 6 of a grid of ``shape`` (rows, columns), of which only
    near ones are searched; each node after the grid, a pole, is a block."""

    def __init__(self, rest: np.ndarray, shape: tuple[int, int]) -> None:
        row, column = np.divmod(np.arange(shape[0] * shape[1]), shape[1])
        across = -(-shape[1] // _SIDE)
        label = row // _SIDE * across + column // _SIDE
        poles = np.arange(len(rest) - len(label))
        self._rest, self._label = rest, np.concatenate([label, label.max() + 1 + poles])
        blocks = [rest[self._label == block] for block in range(self._label.max() + 1)]
        self._centre = np.array([(nodes.min(axis=0) + nodes.max(axis=0)) / 2 for nodes in blocks])
        self._radius = np.array([
            np.linalg.norm(nodes - centre, axis=1).max() for nodes, centre in zip(blocks, self._centre, strict=True)
        ])  # fmt: skip

    def near(self, indenter: Indenter, pose: Pose, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Find the nodes (k,), sorted, inside an indenter or within ``reach`` m of it, and their distances (k,) m."""
        close = pose.distance(indenter, self._centre)[0] < reach + _STEEPEST * self._radius
        nodes = np.flatnonzero(close.take(self._label))
        gap = pose.distance(indenter, self._rest.take(nodes, axis=0))[0]
        found = gap < reach
        return nodes[found], gap[found]
