"""The BioTac's skin and core as structured surfaces, from the profile table of the public mesh."""

from __future__ import annotations

import functools

import numpy as np

from ...errors import TactileError
from ...geometry.catmull_rom import catmull_rom
from ...geometry.lattice import Lattice, cap_faces, grid_faces
from ..descriptor import of_kind
from ..fluid_sensor import Fluid
from ..profiles import read_radii

DESCRIPTOR = of_kind("biotac", Fluid)
_SKIN, _LATTICE = DESCRIPTOR.skin, DESCRIPTOR.lattice
AXIS_Y = _SKIN.axis_y
PAD_ANGLE, SKIN_THICKNESS = _SKIN.pad_half_angle, _SKIN.thickness
_POLES = {"outer": _SKIN.outer_poles, "inner": _SKIN.inner_poles}


@functools.cache
def angles() -> np.ndarray:
    """Angles (columns,) rad about the axis, 0 at the pad's lowest line, growing toward +z, from -pi up."""
    pad = np.linspace(-PAD_ANGLE, PAD_ANGLE, _LATTICE.pad_intervals + 1)
    back = np.linspace(PAD_ANGLE, 2 * np.pi - PAD_ANGLE, _LATTICE.back_intervals + 1)[1:-1]
    back = np.where(back > np.pi - 1e-9, back - 2 * np.pi, back)
    return np.sort(np.concatenate([pad, back]))


def _mean_of_known(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    mean = (a + b) / 2
    return np.where(np.isnan(a), b, np.where(np.isnan(b), a, mean))


@functools.cache
def _table() -> dict[str, np.ndarray]:
    """Read x (60,) m, theta (72,) rad and radii (60, 72) m of outer skin, inner skin and core, made even in theta."""
    rows = read_radii(DESCRIPTOR.folder / _SKIN.profile)
    mirror = (-np.arange(72)) % 72  # the table starts at -180 degrees in 5 degree steps
    radii = _mean_of_known(rows[..., 2:], rows[:, mirror, 2:]) * 1e-3
    return {
        "x": rows[:, 0, 0] * 1e-3,
        "theta": np.radians(rows[0, :, 1]),
        "outer": radii[..., 0],
        "inner": radii[..., 1],
        "core": radii[..., 2],
    }


def _piece(x: np.ndarray, r: np.ndarray, low: float, high: float, fractions: np.ndarray) -> np.ndarray:
    """Points (n, 2) at fractions of the arc length of the polyline (x, r) between x = low and x = high."""
    keep = (x > low) & (x < high)
    ends = np.interp([low, high], x, r)
    line = np.column_stack([np.r_[low, x[keep], high], np.r_[ends[0], r[keep], ends[1]]])
    length = np.r_[0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
    at = fractions * length[-1]
    return np.column_stack([np.interp(at, length, line[:, 0]), np.interp(at, length, line[:, 1])])


def _meridian(layer: str, column: int) -> np.ndarray:
    """Points (rows, 2) = (x, r) in m along one meridian of the table, from the tip pole to the base pole."""
    table = _table()
    known = np.isfinite(table[layer][:, column])
    x, r = table["x"][known], table[layer][known, column]
    tip, base = _POLES[layer]
    x, r = np.r_[min(tip, x[0] - 1e-6), x, base], np.r_[0, r, 0]
    if layer == "inner":  # the table ends before the inner cap's corner: rounded as the outer one is
        x, r = np.insert(x, -1, base - 5e-6), np.insert(r, -1, r[-2] - 0.5e-3)
    pieces = [
        _piece(x, r, x[0], _SKIN.tip_x, np.linspace(0, 1, _LATTICE.tip_rows + 1)),
        _piece(x, r, _SKIN.tip_x, _SKIN.base_x, np.linspace(0, 1, _LATTICE.trunk_rows + 1))[1:],
        _piece(x, r, _SKIN.base_x, base, np.linspace(0, 1, _LATTICE.base_rows + 1))[1:],
    ]
    return np.concatenate(pieces)


def _around(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Periodic cubic (Catmull-Rom) interpolation of values (..., 72) on the table's angles, at angles (n,)."""
    return sum(weight * values[..., column] for column, weight in zip(*_columns(at), strict=True))


def _columns(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The table's columns (4, n) next to angles (n,), and their weights (4, n)."""
    position = (at + np.pi) / (2 * np.pi) * 72
    cell = np.floor(position + 1e-9).astype(int)
    return (cell + np.arange(-1, 3)[:, None]) % 72, catmull_rom(position - cell)


@functools.cache
def skin_grid(layer: str) -> np.ndarray:
    """Nodes (stations, columns, 3) m of the ``"outer"`` or ``"inner"`` skin.

    Stations run from the tip pole to the base pole (both included, each one point repeated over the columns);
    outer and inner points of one station and column face each other through the skin.
    """
    return skin_points(layer, angles())


def skin_points(layer: str, theta: np.ndarray) -> np.ndarray:
    """The stations of ``skin_grid`` at any angles (columns,) rad: (stations, columns, 3) m."""
    x, r = np.moveaxis(_around(_meridians(layer), theta), 1, 0)
    x[[0, -1]] = x[[0, -1]].mean(axis=1, keepdims=True)
    r[[0, -1]] = 0
    return np.stack([x, AXIS_Y - r * np.cos(theta), r * np.sin(theta)], -1)


@functools.cache
def _meridians(layer: str) -> np.ndarray:
    return np.stack([_meridian(layer, column) for column in range(72)], -1)  # (stations, 2, 72)


def core_radius(x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Radius of the rigid core, m, about the axis at stations x (n,) m and angles theta (n,) rad; nan off the core."""
    return _radius("core", x, theta)


def _radius(layer: str, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    table = _table()
    row = np.clip(np.searchsorted(table["x"], x) - 1, 0, len(table["x"]) - 2)
    t = (x - table["x"][row]) / (table["x"][row + 1] - table["x"][row])
    columns, weights = _columns(theta)
    lower, upper = ((weights * table[layer][at, columns]).sum(axis=0) for at in (row, row + 1))
    return lower * (1 - t) + upper * t


def check_inside(points: np.ndarray) -> None:
    """Raise TactileError where one of the electrodes at points (n, 3) m does not lie inside the inner skin."""
    x, y, z = points.T
    inside = np.hypot(y - AXIS_Y, z) < _radius("inner", x, np.arctan2(z, AXIS_Y - y))
    if not inside.all():
        at = points[int(np.argmin(inside))]
        found = f"an electrode at x, y, z = {', '.join(f'{1e3 * each:.3g}' for each in at)} mm, outside the body"
        where = DESCRIPTOR.folder / DESCRIPTOR.electrodes.places
        raise TactileError(where, found, "places inside the inner skin, mm in the maker's frame of [frame]")


@functools.cache
def skin_surface(layer: str = "outer") -> Lattice:
    """The outer (or inner) skin at rest: rows from tip to base, columns round the axis, then the two poles.

    The inner skin's triangles point away from the solid too, into the fluid.
    """
    grid = skin_grid(layer)
    stations, columns = grid.shape[:2]
    rows = stations - 2
    rest = np.concatenate([grid[1:-1].reshape(-1, 3), grid[:1, 0], grid[-1:, 0]])
    ring = np.arange(columns)
    faces = np.concatenate(
        [
            grid_faces(rows, columns, closed=True),
            cap_faces(rows * columns, ring),
            cap_faces(rows * columns + 1, (rows - 1) * columns + ring)[:, ::-1],
        ]
    )
    outward = faces if layer == "outer" else faces[:, ::-1]
    return Lattice(rest, np.ascontiguousarray(outward), (rows, columns))
