"""Stiffness of the points that touch, the inverse of their compliance: it gives the forces that move them.

From one iteration to the next, and from one step of a path to the next, few points come or go. The inverse is then
changed in place (the Schur complement: W. Hager, SIAM Review 31, 1989, 221-239), which costs a fraction of a new one.
Compliances among touching points are well conditioned (30 for 300 nodes of the DIGIT, 200 for 140 of the BioTac), so
that single precision resolves the inverse to 1e-6; Newton's method corrects the rest.
"""

from __future__ import annotations

import numpy as np

from .active_set import UnsolvedError
from .compliance_rows import RIDGE, ComplianceBlock

_MOST_UPDATES = 50  # of one inverse, before it is made anew: rounding adds up
_SMALL = 90  # rows, of inverses that are made anew as soon as they are changed
_GOES, _COMES, _FEW = 2, 4, 0.8  # operations by the square of the size; up to this share of the whole changes are made
_STRIP = 64  # rows that are mirrored at a time, so that they stay in the processor's cache


class ContactStiffness:
    """Inverse of the compliance among the points that touch, updated as points come and go. A point that has left may
    keep its rows and columns, as zeros: to take them out would cost a copy."""

    def __init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        self._inverse = np.empty((0, 0), np.float32)
        self._keys = np.empty(0, np.int64)  # of its rows, see ``ComplianceBlock.keys``
        self._rows = np.empty(0, np.int64)  # of the block that was asked about last
        self._touching = np.empty(0, bool)  # which are not zero
        self._block: ComplianceBlock | None = None
        self._updates = 0

    def among(self, block: ComplianceBlock, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the stiffness (j, j) float32 N/m among a block's ``active`` (k + c,) bool points, and the position
        (j,) of each of its rows among the block's 3 k + c degrees of freedom.

        A node has three successive rows; rows of points that are not active are zero. The next call changes the array
        in place. Raises UnsolvedError if the compliance is not positive definite."""
        wanted = np.concatenate([np.repeat(active[: block.k], 3), active[block.k :]])
        if not len(wanted):
            self._forget()  # no row is one of the block's
        at, there = self._rows, np.ones(len(self._rows), bool)
        if block is not self._block:
            at = np.minimum(np.searchsorted(block.keys, self._keys), len(block.keys) - 1)
            there = block.keys[at] == self._keys
        stays, new = self._touching & there & wanted[at], wanted.copy()
        new[at[stays]] = False
        gone = np.flatnonzero(self._touching & ~stays)
        if block is not self._block or new.any() or len(gone):
            self._updates += 1
            if not (self._is_quick(len(gone), new, wanted) and self._change(block, gone, new, at, there)):
                self._forget()  # should it not be definite
                rows = np.flatnonzero(wanted)
                self._inverse, self._rows = _inverted(_among(block.matrix, rows)), rows
            self._block, self._keys, self._touching = block, block.keys[self._rows], wanted[self._rows]
        return self._inverse, self._rows

    def _is_quick(self, gone: int, new: np.ndarray, wanted: np.ndarray) -> bool:
        """Return true if changing the inverse costs less than making it anew, and adds up little rounding.
        gone : number of rows to take out; new, wanted : (m,) bool, the block's unknowns to add, and all wanted
        """
        size, most = int(wanted.sum()), len(self._inverse) + int(new.sum())
        effort = _GOES * gone * len(self._inverse) ** 2 + _COMES * int(new.sum()) * most**2
        return size >= _SMALL and effort <= _FEW * size**3 and self._updates <= _MOST_UPDATES

    def _change(
        self, block: ComplianceBlock, gone: np.ndarray, new: np.ndarray, at: np.ndarray, there: np.ndarray
    ) -> bool:
        """Take rows ``gone`` (i,) out, add the block's unknowns ``new`` (m,) bool; return false if rounding prevents
        it.

        at : (j,), positions of the inverse's rows in the block; there : (j,) bool, which of them the block has
        """
        try:
            _release(self._inverse, gone)
            if not there.all():
                kept = np.flatnonzero(there)
                self._inverse, at = self._inverse.take(kept, 0).take(kept, 1), at[kept]
            row = np.full(len(new), -1)
            row[at] = np.arange(len(at))
            more = np.flatnonzero(new & (row < 0))
            if len(more):
                row[more] = len(at) + np.arange(len(more))
                self._inverse, at = np.pad(self._inverse, (0, len(more))), np.concatenate([at, more])
            _admit(self._inverse, block.matrix, at, row[new])
        except UnsolvedError:
            return False
        self._rows = at
        return True


def _among(matrix: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the part (j, j) of a compliance matrix (s, s) at rows (j,), its diagonal times 1 + ``RIDGE``."""
    part = matrix.take(rows, 0).take(rows, 1)
    part.reshape(-1)[:: len(rows) + 1] *= 1 + RIDGE
    return part


def _add_product(matrix: np.ndarray, factor: float, first: np.ndarray, second: np.ndarray) -> None:
    """Add ``factor`` first.T @ second, symmetric, to a matrix (j, j) in place; first, second : (i, j) float32"""
    from scipy.linalg import blas

    blas.sgemm(factor, second.T, first.T, 1.0, matrix.T, trans_b=1, overwrite_c=1)


def _release(inverse: np.ndarray, gone: np.ndarray) -> None:
    """Take the rows ``gone`` (i,) out of an inverse in place; they become zero."""
    if not len(gone):
        return
    rows = inverse.take(gone, 0)
    _add_product(inverse, -1.0, rows, _inverted(rows.take(gone, 1)) @ rows)
    inverse[gone] = 0
    inverse[:, gone] = 0


def _admit(inverse: np.ndarray, matrix: np.ndarray, at: np.ndarray, new: np.ndarray) -> None:
    """Add rows ``new`` (i,), zero so far, to an inverse (j, j) in place.
    matrix : (s, s), the compliance; at : (j,), positions in it of the inverse's rows"""
    if not len(new):
        return
    across = matrix.take(at[new], 0).take(at, 1)
    relief = across @ inverse
    own = _inverted(_among(matrix, at[new]) - relief @ across.T)
    side = own @ relief
    _add_product(inverse, 1.0, relief, side)
    side[:, new] = -own
    inverse[new] = -side
    inverse[:, new] = -side.T


def _inverted(matrix: np.ndarray) -> np.ndarray:
    """Return the inverse of a symmetric matrix (j, j) float32, overwriting it. UnsolvedError if it is not definite."""
    from scipy.linalg import lapack

    # LAPACK stores by columns: what it takes for the lower half is the upper one here.
    factor, failed = lapack.spotrf(matrix.T, lower=1, overwrite_a=1) if len(matrix) else (matrix, 0)
    if len(matrix) and not failed:
        factor, failed = lapack.spotri(factor, lower=1, overwrite_c=1)
    if failed:
        raise UnsolvedError("the compliance of the touching nodes is not positive definite")
    whole = factor.T
    for start in range(0, len(whole), _STRIP):
        part, after = slice(start, start + _STRIP), slice(start + _STRIP, None)
        whole[part, part] = np.triu(whole[part, part]) + np.triu(whole[part, part], 1).T
        whole[after, part] = whole[part, after].T
    return whole
