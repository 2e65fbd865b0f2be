"""Response of the whole surface, the sensing points and the fluid to the forces of a contact."""

from __future__ import annotations

import numpy as np

from ...files.compiled import available
from .compliance import Compliance
from .surface_loops import surface_motion

_MIRROR = np.array([1.0, 1.0, -1.0])


def runs(indices: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Find stretches of consecutive numbers in sorted ``indices``: (start, stop) there, and the numbers' own."""
    cuts = np.flatnonzero(np.diff(indices) != 1) + 1
    starts, stops = np.r_[0, cuts], np.r_[cuts, len(indices)]
    return list(
        zip(starts.tolist(), stops.tolist(), indices[starts].tolist(), (indices[stops - 1] + 1).tolist(), strict=True)
    )


def displacement(
    compliance: Compliance, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray
) -> np.ndarray:
    """Return the surface's motion (n, 3) float32 m by forces (k, 3) N at sorted ``nodes``, (c,) at sensing points."""
    rows, mirror, image = compliance.answers
    row, mirrored = rows[nodes], mirror[nodes]
    if available():
        moved = surface_motion(compliance.move, row, mirrored, image, force, compliance.inner_move, inner, inner_force)
        return moved.reshape(-1, 3)
    moved = _under(compliance, row[~mirrored], force[~mirrored])
    if mirrored.any():
        order = np.argsort(row[mirrored], kind="stable")
        there = _under(compliance, row[mirrored][order], force[mirrored][order] * _MIRROR)
        moved += (there.reshape(-1, 3)[image] * _MIRROR.astype(np.float32)).ravel()
    if len(inner):
        moved += inner_force.astype(np.float32) @ compliance.inner_move[inner]
    return moved.reshape(-1, 3)


def _under(compliance: Compliance, row: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Motion (3 n,) of the surface under forces (k, 3) N at the nodes of sorted rows (k,) of the compliance."""
    moved, force = np.zeros(compliance.move.shape[1], np.float32), force.astype(np.float32)
    for start, stop, first, last in runs(row) if len(row) else ():
        moved += force[start:stop].ravel() @ compliance.move[3 * first : 3 * last]
    return moved


def sensing_gaps(
    compliance: Compliance, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray, count: int
) -> np.ndarray:
    """Return the gaps (count,) m of the first sensing points under the same forces."""
    gaps = compliance.watch_gap[:count].astype(float)
    if not len(gaps):
        return gaps
    for start, stop, first, last in runs(nodes) if len(nodes) else ():
        gaps = gaps + force[start:stop].ravel().astype(np.float32) @ compliance.watch[3 * first : 3 * last, :count]
    if len(inner):
        gaps = gaps + inner_force.astype(np.float32) @ compliance.inner_watch[inner, :count]
    return gaps
