"""Cubic splines through evenly spaced nodes, exact there: as matrices, and (Catmull-Rom) as surfaces on grids."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


class EvenSpline:
    """The cubic spline with not-a-knot ends (de Boor, A Practical Guide to Splines, chapter IV) on an even grid.

    start, step : position of the first node and distance between nodes, any unit; count : number of nodes, 5 or more
    Values at nodes v (count, ...) have B-spline coefficients ``to_coefficients @ v`` (count + 2, ...). Positions beyond
    an end count as the end: the spline is constant there.
    """

    def __init__(self, start: float, step: float, count: int) -> None:
        if count < 5:
            raise ValueError(f"a not-a-knot spline needs 5 nodes or more, not {count}")
        self.start, self.step, self.count = start, step, count
        self.to_coefficients = _interpolation_matrix(count)

    @classmethod
    def through(cls, nodes: np.ndarray) -> EvenSpline:
        """Make the spline whose nodes lie at the evenly spaced positions ``nodes`` (count,)."""
        return cls(nodes[0], (nodes[-1] - nodes[0]) / (len(nodes) - 1), len(nodes))

    @property
    def nodes(self) -> np.ndarray:
        """Positions (count,) of the nodes."""
        return self.start + self.step * np.arange(self.count)

    def refined(self, factor: int) -> EvenSpline:
        """Return a spline whose grid has ``factor`` intervals for each of this one's, with the same ends."""
        return EvenSpline(self.start, self.step / factor, (self.count - 1) * factor + 1)

    def cells(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return, for each position (n,), the index (n,) of its first of four coefficients, which is that of the node
        before it; and its place (n,), 0 to 1, between that node and the next."""
        place = np.clip((position - self.start) / self.step, 0, self.count - 1)
        cell = np.minimum(place.astype(np.intp), self.count - 2)
        return cell, place - cell

    def matrix(self, position: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Return the matrix (n, count) from values at nodes to the spline's values at position (n,) or, if
        ``derivative`` is 1, to its slopes there."""
        cell, place = self.cells(position)
        basis = np.zeros((len(cell), self.count + 2))
        weights = bspline_slopes(place) / self.step if derivative else bspline_weights(place)
        np.put_along_axis(basis, cell[:, None] + np.arange(4), weights.T, axis=1)
        matrix = basis @ self.to_coefficients
        if not derivative:  # reproduce nodes exactly, not just to rounding
            at_node = np.abs(place - np.rint(place)) < 1e-9
            matrix[at_node] = np.eye(self.count)[(cell + np.rint(place).astype(np.intp))[at_node]]
        return matrix


def bspline_weights(t: np.ndarray) -> np.ndarray:
    """Return the four uniform cubic B-splines (4, n) at places t (n,), 0 to 1, in their interval; they sum to 1."""
    s = 1 - t
    weights = np.empty((4, len(t)), t.dtype)
    weights[0] = s * s * s / 6
    weights[1] = 2 / 3 - t * t * (1 - t / 2)
    weights[2] = 2 / 3 - s * s * (1 - s / 2)
    weights[3] = t * t * t / 6
    return weights


def bspline_slopes(t: np.ndarray) -> np.ndarray:
    """Return the derivatives (4, n) of ``bspline_weights`` with respect to t (n,)."""
    s = 1 - t
    return np.stack([-s * s, 3 * t * t - 4 * t, 4 * s - 3 * s * s, t * t]) / 2


def _interpolation_matrix(count: int) -> np.ndarray:
    system = np.zeros((count + 2, count + 2))
    for k in range(count):
        system[k + 1, k : k + 3] = 1 / 6, 4 / 6, 1 / 6
    # Not-a-knot: the third derivative does not jump at the second node from either end.
    system[0, :5] = system[-1, -5:] = 1, -4, 6, -4, 1
    return np.linalg.inv(system)[:, 1:-1]


_STEPS = np.arange(-1, 3)[:, None]


def on_grid(axes: np.ndarray, places: np.ndarray, *, closed: bool) -> np.ndarray:
    """Return points (n, 3) m of the surface through nodes ``axes`` (3, rows, columns) m at (row, column) places (2, n).

    axes : contiguous; places : real-valued, node (i, j) at (i, j)
    closed : true if the last column joins the first; places beyond an end that is not joined count as the end"""
    return _points_on_grid(axes, np.ascontiguousarray(places, float), closed)


def stencil(shape: tuple[int, int], places: np.ndarray, *, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return, for (row, column) places (2, n) on a grid of ``shape`` (rows, columns), the 4 x 4 nodes (4, 4, n) around
    each, as row * columns + column, and their Catmull-Rom weights (4, 4, n).
    closed : true if the last column joins the first; places beyond an edge that is not joined count as the edge"""
    rows, columns = shape
    ends = np.array([[rows - 1], [columns - 1]])
    held = np.minimum(np.maximum(places, 0), ends)
    if closed:
        held[1] = places[1]
    cell = np.floor(held).astype(int)
    cell[0] = np.minimum(cell[0], rows - 2)
    if not closed:
        cell[1] = np.minimum(cell[1], columns - 2)
    along, across = catmull_rom(held - cell).swapaxes(0, 1)
    at_row = np.minimum(np.maximum(cell[0] + _STEPS, 0), rows - 1)
    at_column = cell[1] + _STEPS
    at_column = at_column % columns if closed else np.minimum(np.maximum(at_column, 0), columns - 1)
    return at_row[:, None] * columns + at_column, along[:, None] * across


def catmull_rom(t: np.ndarray | float) -> np.ndarray:
    """Return the Catmull-Rom weights (4, ...), cubic, of nodes -1, 0, 1, 2 at places t (...), 0 to 1."""
    square = t * t
    cube = square * t  # numpy's general power takes ten times as long
    return np.array([
        -t / 2 + square - cube / 2,
        1 - 2.5 * square + 1.5 * cube,
        t / 2 + 2 * square - 1.5 * cube,
        (cube - square) / 2,
    ])  # fmt: skip


@Loop
def _points_on_grid(axes, places, closed):  # noqa: ANN001, ANN202
    """Compute ``on_grid`` in a loop."""
    rows, columns = axes.shape[1], axes.shape[2]
    points, along, across = np.empty((places.shape[1], 3)), np.empty(4), np.empty(4)
    for p in range(places.shape[1]):
        row = min(max(places[0, p], 0.0), float(rows - 1))
        column = places[1, p] if closed else min(max(places[1, p], 0.0), float(columns - 1))
        first_row, first_column = min(int(np.floor(row)), rows - 2), int(np.floor(column))
        if not closed:
            first_column = min(first_column, columns - 2)
        for t, weights in ((row - first_row, along), (column - first_column, across)):
            square = t * t
            cube = square * t
            weights[0] = -t / 2 + square - cube / 2
            weights[1] = 1 - 2.5 * square + 1.5 * cube
            weights[2] = t / 2 + 2 * square - 1.5 * cube
            weights[3] = (cube - square) / 2
        for axis in range(3):
            total = 0.0
            for i in range(4):
                a = min(max(first_row + i - 1, 0), rows - 1)
                for j in range(4):
                    b = first_column + j - 1
                    b = b % columns if closed else min(max(b, 0), columns - 1)
                    total += (along[i] * across[j]) * axes[axis, a, b]
            points[p, axis] = total
    return points
