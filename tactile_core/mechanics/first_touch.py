"""Where an indenter first touches a sensor's resting surface as it moves in: depth is counted from there."""

from __future__ import annotations

import numpy as np

from .. import biotac_shape
from ..indenters import Indenter, Pose
from ..lattice import Lattice

_ADVANCES = 60  # of the whole body by its smallest distance: it never goes through
_TOUCHES = 1e-9  # m, smallest distance at which the body is taken to touch
_CLOSE = 60e-6  # m: nodes this little farther than the first one may hide the true first place between them
_MOST_PLACES = 12
_FINER = (4, 16, 64, 256)  # of a lattice spacing: 1.4 um at last, which hides less than 1 nm of a ball of 1 mm
_CLEAR = (1e-3, 12e-3)  # m, from where the motion starts: from the second no indenter reaches the sensor
_NEAR = 4e-3  # m, nodes this much farther than the nearest one are not touched first, for all tilts to 45 degrees


def first_touch(lattice: Lattice, indenter: Indenter, pose: Pose) -> Pose:
    """The pose moved along its direction, in or out, until the indenter just touches the resting surface.

    Between nodes the surface is the lattice's cubic (Catmull-Rom) interpolation.
    """
    for clear in _CLEAR:
        away = pose.moved(-clear)
        gap, _ = away.distance(indenter, lattice.rest)
        if gap.min() > 0:
            break
    pose = _advance(indenter, away, lattice.rest[gap < gap.min() + _NEAR])
    gap, _ = pose.distance(indenter, lattice.rest)
    rows, columns = lattice.shape
    order = np.argsort(gap, kind="stable")[:_MOST_PLACES]
    nodes = order[(gap[order] < gap[order[0]] + _CLOSE) & (order < rows * columns)]
    grid = lattice.grid(lattice.rest)
    closed = len(lattice.rest) > rows * columns  # a surface with poles closes round its axis
    places = np.stack([nodes // columns, nodes % columns], -1).astype(float)
    around = np.stack(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5), indexing="ij"), -1).reshape(1, -1, 2)
    for finer in _FINER if len(places) else ():
        tried = places[:, None] + around / finer
        gap, _ = pose.distance(indenter, _on_surface(grid, tried.reshape(-1, 2), closed=closed))
        best = np.argmin(gap.reshape(len(places), -1), axis=1)
        places = tried[np.arange(len(places)), best]
        pose = _advance(indenter, pose.moved(-_CLOSE), _on_surface(grid, places, closed=closed))
    return pose


def _advance(indenter: Indenter, pose: Pose, points: np.ndarray) -> Pose:
    for _ in range(_ADVANCES):
        gap, _ = pose.distance(indenter, points)
        smallest = float(gap.min())
        pose = pose.moved(smallest)
        if abs(smallest) < _TOUCHES:
            break
    return pose


def _on_surface(grid: np.ndarray, places: np.ndarray, *, closed: bool) -> np.ndarray:
    """Points (n, 3) of the interpolated surface at fractional (row, column) places (n, 2)."""
    rows, columns = grid.shape[:2]
    row = np.clip(places[:, 0], 0, rows - 1)
    column = places[:, 1] if closed else np.clip(places[:, 1], 0, columns - 1)
    i = np.minimum(np.floor(row).astype(int), rows - 2)
    j = np.floor(column).astype(int)
    if not closed:
        j = np.minimum(j, columns - 2)
    across, along = biotac_shape.catmull_rom(row - i), biotac_shape.catmull_rom(column - j)
    points = np.zeros((len(places), 3))
    for a in range(4):
        for b in range(4):
            at_row = np.clip(i + a - 1, 0, rows - 1)
            at_column = (j + b - 1) % columns if closed else np.clip(j + b - 1, 0, columns - 1)
            points += (across[a] * along[b])[:, None] * grid[at_row, at_column]
    return points
