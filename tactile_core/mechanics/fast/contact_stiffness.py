"""Stiffness of the points that touch: the forces under which they move by given ways, the inverse of their compliance.

From one iteration to the next, and from one step of a path to the next, few points come or go. The inverse is then
changed by blocks (the Schur complement: W. Hager, SIAM Review 31, 1989, 221-239), where a new factor would cost a
multiple. Compliances among touching points are well conditioned (30 for 300 nodes of the DIGIT, 200 for 140 of the
BioTac), so that single precision resolves the inverse to 1e-6; what it misses, Newton's method makes good.
"""

from __future__ import annotations

import numpy as np

from .active_set import UnsolvedError
from .compliance_rows import RIDGE, ComplianceBlock

_MOST_UPDATES = 50  # of one inverse, before it is made anew: rounding adds up
_SMALL = 90  # rows, of inverses that are made anew as soon as they are changed
_GOES, _COMES, _FEW = 2, 4, 0.8  # operations by the square of the size; up to this share of the whole changes are made


class ContactStiffness:
    """Keeps the inverse of the compliance among the points that touched last."""

    def __init__(self) -> None:
        self._inverse = np.empty((0, 0), np.float32)
        self._keys = np.empty(0, np.int64)  # of its rows, see ``ComplianceBlock.keys``
        self._rows = np.empty(0, np.int64)  # of the block that was asked about last
        self._block: ComplianceBlock | None = None
        self._updates = 0

    def among(self, block: ComplianceBlock, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the stiffness (j, j) float32 N/m among a block's ``active`` (k + c,) points, and its rows' places.

        places : (j,), each row's among the block's 3 k + c degrees of freedom; three of a node follow each other
        Raises UnsolvedError where the compliance is not positive definite.
        """
        wanted = np.zeros(len(block.matrix), bool)
        wanted[: 3 * block.k].reshape(-1, 3)[:] = active[: block.k, None]
        wanted[3 * block.k :] = active[block.k :]
        stays = self._staying(block, wanted)
        left = self._rows[stays]
        wanted[left] = False
        new = np.flatnonzero(wanted)
        if not len(new) and len(left) == len(stays):
            return self._inverse, self._rows
        before, self._updates = self._inverse, self._updates + 1
        self._inverse, rows = np.empty((0, 0), np.float32), np.concatenate([left, new])
        self._rows, self._keys = rows[:0], block.keys[:0]  # what stays where the compliance is not definite
        inverse = self._changed(before, stays, block.matrix, left, new)
        if inverse is None:
            rows, self._updates = np.sort(rows), 0
            inverse = _inverted(_among(block.matrix, rows, rows))
        self._inverse, self._rows, self._keys = inverse, rows, block.keys[rows]
        return self._inverse, self._rows

    def _changed(self, inverse, stays, matrix, left, new) -> np.ndarray | None:  # noqa: ANN001
        """The inverse without rows that do not stay (j,), and with ``new`` ones; None where it is better made anew."""
        size, gone = len(left) + len(new), len(stays) - len(left)
        effort = _GOES * gone * len(stays) ** 2 + _COMES * len(new) * size**2
        if size < _SMALL or effort > _FEW * size**3 or self._updates > _MOST_UPDATES:
            return None
        try:
            inverse = _without(inverse, stays) if gone else inverse
            return _with(inverse, matrix, left, new) if len(new) else inverse
        except UnsolvedError:  # rounding has added up
            return None

    def _staying(self, block: ComplianceBlock, wanted: np.ndarray) -> np.ndarray:
        """Mark (j,) the rows that are wanted still, and let ``_rows`` be those of ``block``."""
        if block is self._block:
            return wanted[self._rows]
        self._block = block
        at = np.minimum(np.searchsorted(block.keys, self._keys), max(len(block.keys) - 1, 0))
        there = block.keys[at] == self._keys if len(block.keys) else np.zeros(len(at), bool)
        self._rows = np.where(there, at, 0)
        return there & wanted[at] if len(block.keys) else there


def _among(matrix: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Part (j, i) of a compliance, stiffened by the ridge where a row is a column."""
    part = matrix.take(rows, 0).take(columns, 1)
    if rows is columns:
        part.reshape(-1)[:: len(rows) + 1] *= 1 + RIDGE
    return part


def _without(inverse: np.ndarray, stays: np.ndarray) -> np.ndarray:
    """Inverse where only the rows that stay (j,) bool are left."""
    kept, gone = np.flatnonzero(stays), np.flatnonzero(~stays)
    of_kept = inverse.take(kept, 0)
    across = of_kept.take(gone, 1)
    released = _inverted(inverse.take(gone, 0).take(gone, 1))
    return of_kept.take(kept, 1) - across @ (released @ across.T)


def _with(inverse: np.ndarray, matrix: np.ndarray, rows: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Inverse with more rows after its own: of ``rows`` (j,) of a compliance, and ``new`` (i,) ones."""
    old, size = len(rows), len(rows) + len(new)
    across = _among(matrix, new, rows)
    relief = across @ inverse
    own = _inverted(_among(matrix, new, new) - relief @ across.T)
    side = own @ relief
    found = np.empty((size, size), np.float32)
    np.add(inverse, relief.T @ side, out=found[:old, :old])
    found[old:, :old], found[old:, old:] = -side, own
    found[:old, old:] = -side.T
    return found


def _inverted(matrix: np.ndarray) -> np.ndarray:
    """Inverse of a symmetric matrix (j, j) float32, which is overwritten. Raises UnsolvedError: it is not definite."""
    from scipy.linalg import lapack

    if not len(matrix):
        return matrix
    # LAPACK stores by columns: what it takes for the lower half is the upper one here.
    factor, failed = lapack.spotrf(matrix.T, lower=1, overwrite_a=1)
    if not failed:
        half, failed = lapack.spotri(factor, lower=1, overwrite_c=1)
    if failed:
        raise UnsolvedError("the compliance of the touching nodes is not positive definite")
    half = np.triu(half.T)
    whole = half + half.T
    whole.reshape(-1)[:: len(half) + 1] *= 0.5
    return whole
