"""Solids refined where an indenter touches: the sensors' own lattices, with fewer lines away from the contact.

The mesh's lines lie at real-valued rows and columns of the sensor's lattice, so that its surface is the sensor's
own. Results are interpolated to the lattice by cubic splines along the lines.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ... import sensors
from ...geometry.cubic_spline import catmull_rom
from ...sensors.gel_shape import GelShape
from .block_pattern import BlockPattern
from .hex_mesh import SKIN_LAYERS, HexMesh, gel_solid, glued_skin, skin_solid
from .sparse_cholesky import PatternFactor

_WIDEST_GEL, _WIDEST_SKIN = 10.0, 6.0  # lattice lines, the widest cell; the skin bends everywhere
_GROWTH = 1.5  # ratio of a cell's size to the next one nearer to the fine part
_KEPT = 6  # patterns kept, each with the analysis and the last factor of its matrix: about 100 MB


@dataclasses.dataclass(frozen=True)
class Footprint:
    """Part of a lattice that a mesh refines, in real-valued rows and columns of the lattice.

    low, high : (row, column) of the part's corners
    spacing : of the nodes there, in lattice spacings
    refine : number of parts that every cell is divided into along each axis
    """

    low: tuple[float, float]
    high: tuple[float, float]
    spacing: float = 1.0
    refine: int = 1


@dataclasses.dataclass(frozen=True)
class GradedMesh:
    """A graded solid, its matrix's sparsity pattern and solver, and its lines.
    rows (i,), columns (j,) : places of the mesh's lines of nodes, in real-valued rows and columns of the lattice
    to_rows (rows, i), to_columns (columns, j) : matrices that interpolate values from the mesh's lines to the
    lattice's; a skin's last line is its first and left out"""

    mesh: HexMesh
    pattern: BlockPattern
    factor: PatternFactor
    rows: np.ndarray
    columns: np.ndarray
    to_rows: np.ndarray
    to_columns: np.ndarray

    def grid(self, values: np.ndarray) -> np.ndarray:
        """Return values (n_surface, k) at the mesh's surface nodes as a grid (rows, columns, k); poles left out."""
        columns = self.to_columns.shape[1]
        return values[: len(values) // columns * columns].reshape(-1, columns, values.shape[1])

    def on_lattice(self, values: np.ndarray) -> np.ndarray:
        """Interpolate values (n_surface, k) at the mesh's surface nodes to the lattice's (n, k), by cubic splines."""
        return self._carry(values, self.to_rows, self.to_columns)

    def nearest_on_lattice(self, flags: np.ndarray) -> np.ndarray:
        """Mark (n,) bool the lattice's nodes where flags (n_surface,) of the mesh's, interpolated, are above 1/2."""
        shares = self._carry(flags[:, None].astype(float), *self._linear())
        return shares[:, 0] > 0.5

    def _linear(self) -> tuple[np.ndarray, np.ndarray]:
        periodic = len(self.columns) > self.to_columns.shape[1]
        count = np.arange(len(self.to_rows)), np.arange(len(self.to_columns))
        rows = np.stack([np.interp(count[0], self.rows, line) for line in np.eye(len(self.rows))], -1)
        columns = np.stack([np.interp(count[1], self.columns, line) for line in np.eye(len(self.columns))], -1)
        if periodic:
            columns[:, 0] += columns[:, -1]
            columns = columns[:, :-1]
        return rows, columns

    def _carry(self, values: np.ndarray, to_rows: np.ndarray, to_columns: np.ndarray) -> np.ndarray:
        """Interpolate values (n_surface, k) by matrices to_rows, to_columns of the class; poles count as whole rows."""
        i, j = to_rows.shape[1], to_columns.shape[1]
        k = values.shape[1]
        if len(values) == i * j:
            grid = np.einsum("ri,ijk,cj->rck", to_rows, values.reshape(i, j, k), to_columns, optimize=True)
            return grid.reshape(-1, k)
        ring, poles = values[: (i - 2) * j].reshape(i - 2, j, k), values[(i - 2) * j :]
        ends = [np.broadcast_to(pole, (1, j, k)) for pole in poles]
        grid = np.concatenate([ends[0], ring, ends[1]])
        body = np.einsum("ri,ijk,cj->rck", to_rows[1:-1], grid, to_columns, optimize=True)
        return np.concatenate([body.reshape(-1, k), poles])


def graded(sensor: str, footprint: Footprint) -> GradedMesh:
    """Make a sensor's solid, fine in ``footprint`` and coarser with the distance from it."""
    return _graded_gel(sensor, footprint) if sensors.is_gel(sensor) else _graded_skin(sensor, footprint)


def _graded_gel(sensor: str, footprint: Footprint) -> GradedMesh:
    shape = sensors.shape_of(sensor)
    plan = shape.plan_grid()
    window = shape.surface().window
    assert window is not None  # a gel's grid is even about its middle
    marks = [(0, part.start, part.stop - 1, size - 1) for part, size in zip(window, plan.shape[:2], strict=True)]
    rows, columns = (_lines(marks[k], footprint, k, _WIDEST_GEL) for k in range(2))
    place = _bilinear(plan, rows, columns)
    top = np.stack([place[..., 0], shape.back_y - shape.dome_height(*np.moveaxis(place, -1, 0)), place[..., 1]], -1)
    mesh = gel_solid(top, shape.back_y, _divided(_gel_layers(shape, footprint.spacing), 2 * footprint.refine))
    pattern, factor = _pattern(mesh, sensor, len(rows), len(columns))
    to_rows, to_columns = _spline(rows, plan.shape[0]), _spline(columns, plan.shape[1])
    return GradedMesh(mesh, pattern, factor, rows, columns, to_rows, to_columns)


def _graded_skin(sensor: str, footprint: Footprint) -> GradedMesh:
    glued = glued_skin(sensor)
    stations, around = glued.shape
    rows = _lines((0, *_SKIN_ROW_MARKS, stations - 1), footprint, 0, _WIDEST_SKIN)
    columns = _lines((0, *_SKIN_COLUMN_MARKS, around), footprint, 1, _WIDEST_SKIN)
    outer, inner = (_skin_points(sensor, layer, rows, columns[:-1]) for layer in ("outer", "inner"))
    nearest = glued[np.rint(rows).astype(int)][:, np.rint(columns[:-1]).astype(int) % around]
    mesh = skin_solid(outer, inner, nearest, 2 * footprint.refine * (SKIN_LAYERS // 2) + 1)
    pattern, factor = _pattern(mesh, sensor, len(rows), len(columns))
    to_columns = _spline(columns, around, periodic=True)
    return GradedMesh(mesh, pattern, factor, rows, columns, _spline(rows, stations), to_columns)


# Lines of the skin's grid that a mesh must keep: where the glued part begins and ends, and where the lines' spacing
# changes (``SkinShape.angles``, ``tip_rows``, ``trunk_rows``).
_SKIN_ROW_MARKS = (10, 18, 45, 52)
_SKIN_COLUMN_MARKS = (9, 12, 52, 55)


def _gel_layers(shape: GelShape, spacing: float) -> np.ndarray:
    """Return cell boundaries through the gel, 0 = back, 1 = surface: the top cell twice ``spacing``, others larger."""
    top = min(2 * spacing * shape.spacing / shape.thickness, 0.2)
    growth = (0.5 / top) ** 0.5 if top > _THIN_TOP else (0.5 / top) ** (1 / 3)
    cells = np.array([0.5, *top * growth ** np.arange(1 if top > _THIN_TOP else 2, -1, -1)])
    return 1 - np.r_[np.cumsum((cells / cells.sum())[::-1])[::-1], 0.0]


_THIN_TOP = 0.12  # of the thickness: below a top cell of this size a fourth cell keeps the growth small


def _lines(marks: tuple[int, ...], footprint: Footprint, axis: int, widest: float) -> np.ndarray:
    """Return places of node lines along an axis, 0 rows or 1 columns, an odd number: through all marks, evenly spaced
    in the footprint, ever wider beyond. widest : the largest cell, in lattice spacings"""
    low, high = footprint.low[axis], footprint.high[axis]
    at = np.linspace(marks[0], marks[-1], 20 * (marks[-1] - marks[0]) + 1)
    beyond = np.maximum(np.maximum(low - at, at - high), 0)
    width = np.minimum(2 * footprint.spacing + _GROWTH * beyond, widest)
    middle = (1 / width[:-1] + 1 / width[1:]) / 2 * np.diff(at)
    cells = np.r_[0, np.cumsum(middle)]  # cells wanted up to each place
    wanted = np.diff(np.interp(marks, at, cells))
    counts = np.maximum(np.rint(wanted).astype(int), 1)
    if counts.sum() % 2:  # even totals: fewer patterns to keep
        counts[np.argmax(wanted / counts)] += 1
    edges = [np.array([float(marks[0])])]
    for first, last, count in zip(marks, marks[1:], counts, strict=False):
        start, stop = np.interp([first, last], at, cells)
        edges.append(np.r_[np.interp(np.linspace(start, stop, count + 1)[1:-1], cells, at), last])
    return _divided(np.concatenate(edges), 2 * footprint.refine)


def _divided(values: np.ndarray, parts: int) -> np.ndarray:
    """Return sorted values with each interval divided into ``parts`` even ones."""
    return np.interp(np.arange(parts * (len(values) - 1) + 1) / parts, np.arange(len(values)), values)


def _bilinear(grid: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return the values of a grid (r, c, k) at real-valued rows and columns, by bilinear interpolation."""
    for axis, places in ((0, rows), (1, columns)):
        cell = np.minimum(places.astype(int), grid.shape[axis] - 2)
        shape = [1] * grid.ndim
        shape[axis] = len(places)
        part = (places - cell).reshape(shape)
        grid = np.take(grid, cell, axis) * (1 - part) + np.take(grid, cell + 1, axis) * part
    return grid


def _skin_points(sensor: str, layer: str, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return points (i, j, 3) m of a skin's layer, "outer" or "inner", at real-valued rows (i,), which are stations,
    and columns (j,), by cubics along both."""
    skin = sensors.skin_of(sensor)
    angles = np.r_[skin.angles, np.pi]
    points = skin.skin_points(layer, np.interp(columns, np.arange(len(angles)), angles))
    cell = np.minimum(rows.astype(int), len(points) - 2)
    weights = catmull_rom(rows - cell)
    last = len(points) - 1
    at = sum(weights[k][:, None, None] * points[np.clip(cell + k - 1, 0, last)] for k in range(4))
    at[[0, -1]] = points[[0, -1]]
    return at


def _spline(lines: np.ndarray, count: int, *, periodic: bool = False) -> np.ndarray:
    """Return the matrix (count, lines) of the cubic spline from values on lines to values at 0 .. count - 1.
    lines : (lines,) places; periodic : true if the last line is the first, and has no column"""
    import scipy.interpolate

    values = np.eye(len(lines))
    if periodic:
        values[-1] = values[0]
        values = values[:, :-1]
    spline = scipy.interpolate.make_interp_spline(lines, values, k=3, bc_type="periodic" if periodic else "not-a-knot")
    return spline(np.arange(count))


_PATTERNS: dict[tuple, tuple[BlockPattern, PatternFactor]] = {}  # the latest used comes last


def _pattern(mesh: HexMesh, *kind: str | int) -> tuple[BlockPattern, PatternFactor]:
    """Return the pattern and solver shared by all meshes of one ``kind`` (sensor, rows, columns) and clamped nodes."""
    key = (*kind, len(mesh.nodes), mesh.clamped.tobytes())
    found = _PATTERNS.pop(key, None) or (BlockPattern(mesh.cells, mesh.clamped), PatternFactor())
    _PATTERNS[key] = found
    while len(_PATTERNS) > _KEPT:
        del _PATTERNS[next(iter(_PATTERNS))]
    return found
