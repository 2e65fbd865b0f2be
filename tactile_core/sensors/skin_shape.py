"""Shape of a fluid sensor from its descriptor: skin and core as structured surfaces, from the table of their radii."""

from __future__ import annotations

import functools

import numpy as np

from ..errors import TactileError
from ..geometry.cubic_spline import catmull_rom
from ..geometry.lattice import Lattice, cap_faces, grid_faces
from .descriptor import of_kind
from .fluid_sensor import Fluid
from .profiles import read_radii

_STEP = 20e-6  # m, of the march from the surface to the core; the last step is interpolated linearly
_FARTHEST = 8e-3  # m, more than from the pad to the finger's axis
_ROUNDING = 0.5e-3  # m, by which the corner of a flat inner cap, where the table ends, is rounded as the outer one is


@functools.cache
def skin_of(name: str) -> SkinShape:
    """Return the shape of a sensor's skin. Raises TactileError for a sensor without one."""
    return SkinShape(of_kind(name, Fluid))


class SkinShape:
    """The resting skin and core of a descriptor, about the axis (y, z) = (``axis_y``, 0); lengths m, angles rad.
    pad_angle : of the part that unrolls, to either side of the lowest line; thickness : of the skin"""

    def __init__(self, descriptor: Fluid) -> None:
        self.descriptor = descriptor
        self._skin, self._lattice = descriptor.skin, descriptor.lattice
        self.axis_y, self.pad_angle = self._skin.axis_y, self._skin.pad_half_angle
        self.thickness = self._skin.thickness
        self._poles = {"outer": self._skin.outer_poles, "inner": self._skin.inner_poles}

    @functools.cached_property
    def angles(self) -> np.ndarray:
        """Angles (columns,) rad about the axis, rising from -pi: 0 at the pad's lowest line, positive toward +z."""
        pad = np.linspace(-self.pad_angle, self.pad_angle, self._lattice.pad_intervals + 1)
        back = np.linspace(self.pad_angle, 2 * np.pi - self.pad_angle, self._lattice.back_intervals + 1)[1:-1]
        back = np.where(back > np.pi - 1e-9, back - 2 * np.pi, back)
        return np.sort(np.concatenate([pad, back]))

    @functools.cached_property
    def table(self) -> dict[str, np.ndarray]:
        """Arrays by name: x (n,) m, theta (72,) rad; radii (n, 72) m outer, inner (of the skin), core, even in z."""
        rows = read_radii(self.descriptor.folder / self._skin.profile)
        mirror = (-np.arange(72)) % 72  # the table starts at -180 degrees in 5 degree steps
        radii = _mean_of_known(rows[..., 2:], rows[:, mirror, 2:]) * 1e-3
        return {
            "x": rows[:, 0, 0] * 1e-3,
            "theta": np.radians(rows[0, :, 1]),
            "outer": radii[..., 0],
            "inner": radii[..., 1],
            "core": radii[..., 2],
        }

    def _meridian(self, layer: str, column: int) -> np.ndarray:
        """Return points (rows, 2) = (x, r) m along one meridian of a layer, from the tip pole to the base pole."""
        table = self.table
        known = np.isfinite(table[layer][:, column])
        x, r = table["x"][known], table[layer][known, column]
        tip, base = self._poles[layer]
        x, r = np.r_[min(tip, x[0] - 1e-6), x, base], np.r_[0, r, 0]
        if layer == "inner" and r[-2] > 2 * _ROUNDING:
            x, r = np.insert(x, -1, base - 5e-6), np.insert(r, -1, r[-2] - _ROUNDING)
        skin, lattice = self._skin, self._lattice
        pieces = [
            _piece(x, r, x[0], skin.tip_x, np.linspace(0, 1, lattice.tip_rows + 1)),
            _piece(x, r, skin.tip_x, skin.base_x, np.linspace(0, 1, lattice.trunk_rows + 1))[1:],
            _piece(x, r, skin.base_x, base, np.linspace(0, 1, lattice.base_rows + 1))[1:],
        ]
        return np.concatenate(pieces)

    @functools.cache  # noqa: B019
    def _meridians(self, layer: str) -> np.ndarray:
        """Return all meridians (stations, 2, 72), (x, r) m, of a layer."""
        return np.stack([self._meridian(layer, column) for column in range(72)], -1)

    @functools.cache  # noqa: B019 - shapes are few and kept by ``skin_of`` anyway
    def skin_grid(self, layer: str) -> np.ndarray:
        """Return nodes (stations, columns, 3) m, sensor frame, of a layer of the skin, ``"outer"`` or ``"inner"``.
        Stations run from the tip pole to the base pole, each pole one point repeated over the columns; columns lie at
        ``angles``. Outer and inner points of one station and column face each other."""
        return self.skin_points(layer, self.angles)

    def skin_points(self, layer: str, theta: np.ndarray) -> np.ndarray:
        """Return nodes (stations, columns, 3) m as ``skin_grid``, for columns at any angles theta (columns,) rad."""
        x, r = np.moveaxis(_around(self._meridians(layer), theta), 1, 0)
        x[[0, -1]] = x[[0, -1]].mean(axis=1, keepdims=True)
        r[[0, -1]] = 0
        return np.stack([x, self.axis_y - r * np.cos(theta), r * np.sin(theta)], -1)

    def core_radius(self, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """Return the core's radius (n,) m at stations x (n,) m and angles theta (n,) rad; NaN off the core."""
        return self._radius("core", x, theta)

    def thickness_below(self, point: np.ndarray, outward: np.ndarray) -> float:
        """Return the distance, m, from point (3,) m of the skin against its normal outward (3,) to core, or axis."""
        distance = np.arange(0, _FARTHEST, _STEP)
        x, y, z = (point - distance[:, None] * outward).T
        radius = np.hypot(y - self.axis_y, z)
        over = radius - self.core_radius(x, np.arctan2(z, self.axis_y - y))
        inside = np.flatnonzero(over <= 0)
        if not len(inside):
            return float(distance[np.argmin(radius)])
        last = int(inside[0])
        before = over[last - 1] if last else np.nan
        back = over[last] / (over[last] - before) if np.isfinite(before) else 0.0
        return float(distance[last] - back * _STEP)

    def _radius(self, layer: str, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
        table = self.table
        row = np.clip(np.searchsorted(table["x"], x) - 1, 0, len(table["x"]) - 2)
        t = (x - table["x"][row]) / (table["x"][row + 1] - table["x"][row])
        columns, weights = _columns(theta)
        lower, upper = ((weights * table[layer][at, columns]).sum(axis=0) for at in (row, row + 1))
        return lower * (1 - t) + upper * t

    def check_inside(self, points: np.ndarray) -> None:
        """Raise TactileError unless all electrodes, at points (n, 3) m, lie inside the inner skin."""
        x, y, z = points.T
        inside = np.hypot(y - self.axis_y, z) < self._radius("inner", x, np.arctan2(z, self.axis_y - y))
        if not inside.all():
            at = points[int(np.argmin(inside))]
            found = f"an electrode at x, y, z = {', '.join(f'{1e3 * each:.3g}' for each in at)} mm, outside the body"
            where = self.descriptor.folder / self.descriptor.electrodes.places
            raise TactileError(where, found, "places inside the inner skin, mm in the maker's frame of [frame]")

    @functools.cache  # noqa: B019
    def skin_surface(self, layer: str = "outer") -> Lattice:
        """Return the "outer" (or "inner") layer of skin at rest: rows from tip to base, columns around the axis, then
        the two poles. Triangles point away from the solid, those of the inner skin into the fluid."""
        grid = self.skin_grid(layer)
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


def _mean_of_known(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    mean = (a + b) / 2
    return np.where(np.isnan(a), b, np.where(np.isnan(b), a, mean))


def _piece(x: np.ndarray, r: np.ndarray, low: float, high: float, fractions: np.ndarray) -> np.ndarray:
    """Return points (n, 2) m at fractions (n,) of the arc length of a polyline, x, r m, between x = low and high m."""
    keep = (x > low) & (x < high)
    ends = np.interp([low, high], x, r)
    line = np.column_stack([np.r_[low, x[keep], high], np.r_[ends[0], r[keep], ends[1]]])
    length = np.r_[0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
    at = fractions * length[-1]
    return np.column_stack([np.interp(at, length, line[:, 0]), np.interp(at, length, line[:, 1])])


def _around(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Interpolate values (..., 72) at the table's angles, by periodic cubics (Catmull-Rom), to angles ``at`` (n,)."""
    return sum(weight * values[..., column] for column, weight in zip(*_columns(at), strict=True))


def _columns(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the table's four columns (4, n) nearest to angles `at` (n,) rad, and their Catmull-Rom weights (4, n)."""
    position = (at + np.pi) / (2 * np.pi) * 72
    cell = np.floor(position + 1e-9).astype(int)
    return (cell + np.arange(-1, 3)[:, None]) % 72, catmull_rom(position - cell)
