"""Frame that moves with a contact: a window of the surface's lattice around the dent, in whole cells.

A dent keeps its shape as it moves, which a fixed linear basis cannot represent: a frame that moves with the contact is
worth a factor of three (docs/sources.md). Whole cells need no interpolation, so nothing is lost; the remaining offset,
within half a cell, is an input of the networks.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..accuracy import CORE
from ..sensors import TARGET

STILL = 1e-9  # m: below, there is no dent to follow and the frame stays in the middle
FADE = 5  # cells (assumed)
PLACE_UNIT = 10.0  # cells per unit of the networks' inputs: places then are of the order of one (assumed)


@dataclass(frozen=True)
class ContactFrame:
    """The lattice of one surface and the window that moves over it.

    rows, columns : of the lattice; nodes behind them (poles) lie in no window
    half : cells from the window's middle to its edge
    turn : (n,) rad, angle about x from the shared frame to each node's own
    sensor : whose surface it is
    """

    rows: int
    columns: int
    half: int
    turn: np.ndarray
    sensor: str = TARGET

    @property
    def width(self) -> int:
        """Nodes across the window."""
        return 2 * self.half + 1

    @functools.cached_property
    def _cosine_sine(self) -> tuple[np.ndarray, np.ndarray]:
        return np.cos(self.turn).astype(np.float32), np.sin(self.turn).astype(np.float32)

    def to_local(self, displacement: np.ndarray) -> np.ndarray:
        """Rotate displacement (T, n, 3) m from the shared frame to each node's own axes: along, inward, around."""
        cosine, sine = self._cosine_sine
        local = np.array(displacement, np.float32)
        local[..., 1] = cosine * displacement[..., 1] - sine * displacement[..., 2]
        local[..., 2] = sine * displacement[..., 1] + cosine * displacement[..., 2]
        return local

    def to_shared(self, local: np.ndarray) -> np.ndarray:
        """Rotate `local` (T, n, 3) m from each node's frame back to the shared one, in place: inverse of `to_local`."""
        if self.turn.any():
            cosine, sine = self._cosine_sine
            inward, around = local[..., 1].copy(), local[..., 2]
            local[..., 1] = cosine * inward + sine * around
            local[..., 2] = cosine * around - sine * inward
        return local

    def place(self, displacement: np.ndarray) -> np.ndarray:
        """Return the place (T, 2) float32 of the dent in displacement (T, n, 3) m, in any frame: row and column from
        the lattice's middle in PLACE_UNIT cells; 0 if no node moves by STILL.
        It is the mean of the nodes that move more than `CORE` of the largest displacement, weighted by theirs."""
        grid = displacement[:, : self.rows * self.columns].astype(np.float32)
        moved = np.sqrt(np.square(grid).sum(-1))
        peak = moved.max(-1, keepdims=True)
        weight = np.where((moved > CORE * peak) & (peak > STILL), moved, 0).reshape(-1, self.rows, self.columns)
        total = weight.sum((1, 2))
        some = np.where(total > 0, total, 1)
        row = weight.sum(2) @ np.arange(self.rows, dtype=np.float32) / some
        column = weight.sum(1) @ np.arange(self.columns, dtype=np.float32) / some
        place = (np.stack([row, column], -1) - self._middle) / PLACE_UNIT
        return np.where(total[:, None] > 0, place, 0).astype(np.float32)

    def cells(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Round place (T, 2), in PLACE_UNIT cells from the middle, to cells of the lattice (T, 2) int; also return the
        remainders (T, 2), in cells, from -1 to 1. NaN counts as the middle."""
        at = np.where(np.isfinite(place), place, 0) * np.float32(PLACE_UNIT) + self._middle
        cell = np.rint(np.minimum(np.maximum(at, 0), 2 * self._middle))
        left = np.minimum(np.maximum(at - cell, -1), 1)  # a place off the lattice counts as its edge
        return cell.astype(np.int64), left.astype(np.float32)

    @functools.cached_property
    def _middle(self) -> np.ndarray:
        return np.array([self.rows - 1, self.columns - 1], np.float32) / 2

    def fade(self) -> np.ndarray:
        """Return weights (width, width) float32: 1 in the window's middle, falling over FADE cells to 0 outside."""
        inside = 1 + self.half - np.abs(np.arange(-self.half, self.half + 1))
        along = 0.5 - 0.5 * np.cos(np.pi * np.minimum(inside / (FADE + 1), 1))
        return np.outer(along, along).astype(np.float32)

    def windows(self, local: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Cut windows (T, width, width, 3) from the field `local` (T, n, 3) around cells (T, 2); beyond it they are
        0."""
        grid = local[:, : self.rows * self.columns].reshape(len(local), self.rows, self.columns, 3)
        out = np.zeros((len(local), self.width, self.width, 3), local.dtype)
        for frame, cell in enumerate(cells):
            on_grid, in_window = self._overlap(cell)
            out[frame][in_window] = grid[frame][on_grid]
        return out

    def add(self, local: np.ndarray, windows: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Add windows (T, width, width, 3) around cells (T, 2) to a field, local (T, n, 3), in place; return it."""
        grid = local[:, : self.rows * self.columns].reshape(len(local), self.rows, self.columns, 3)  # a view
        for frame, cell in enumerate(cells):
            on_grid, in_window = self._overlap(cell)
            grid[frame][on_grid] += windows[frame][in_window]
        return local

    def _overlap(self, cell: np.ndarray) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
        """Return rows and columns of the lattice that the window around a cell (2,) covers, and theirs in the
        window."""
        on_grid, in_window = [], []
        for middle, size in zip(cell.tolist(), (self.rows, self.columns), strict=True):
            first, last = max(middle - self.half, 0), min(middle + self.half + 1, size)
            on_grid.append(slice(first, last))
            in_window.append(slice(first - middle + self.half, last - middle + self.half))
        return (on_grid[0], on_grid[1]), (in_window[0], in_window[1])


def frame_of(sensor: str, half: int) -> ContactFrame:
    """Return the moving frame of a sensor's surface, its window ``half`` cells to each side. The nodes' own axes on a
    skin turn with their angle about its axis; a gel's are the shared ones."""
    lattice = sensors.sensor_surface(sensor)
    turn = np.zeros(len(lattice.rest), np.float32)
    if not sensors.is_gel(sensor):
        rows, columns = lattice.shape
        turn[: rows * columns] = np.tile(sensors.skin_of(sensor).angles, rows)
    return ContactFrame(*lattice.shape, half, turn, sensor)


def between_nodes(grid: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Interpolate grid (rows, columns, k), values at a lattice's nodes, bilinearly; return (F, k).
    place : (F, 2), row and column from the lattice's middle in PLACE_UNIT cells; places outside count as the edge"""
    size = np.array(grid.shape[:2])
    at = np.clip(place * PLACE_UNIT + (size - 1) / 2, 0, size - 1)
    cell = np.minimum(at.astype(int), size - 2)
    (i, j), (t, s) = cell.T, (at - cell).T[:, :, None]
    before, behind = ((1 - s) * grid[row, j] + s * grid[row, j + 1] for row in (i, i + 1))
    return (1 - t) * before + t * behind
