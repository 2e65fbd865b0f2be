"""Solve a contact's linear complementarity problem exactly: which nodes touch, and with what force.

Block principal pivoting exchanges all wrong nodes at once; if that makes no progress, one at a time, which always ends
for a symmetric positive definite matrix. J. Judice, F. Pires, Computers and Operations Research 21, 1994, 587-596; K.
Murty, Opsearch 11, 1974.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from .coulomb import FORCE_NOISE

_PATIENCE = 5  # exchanges of all wrong nodes that may bring no progress before nodes change one by one
_MOST_EXCHANGES = 400
_GAP_ROUNDING = 1e-10  # m: below what single precision of the compliance resolves


class UnsolvedError(ArithmeticError):
    """Error of a contact that is not found: its matrix is not positive definite, no node can carry the force, or
    iterations do not end."""


class ExhaustedError(UnsolvedError):
    """Error of a contact whose budget, ``Work``, is used up."""


@dataclasses.dataclass
class Work:
    """Budget of computing for contacts; ``left`` : what remains. A solver's iteration costs its unknowns cubed."""

    left: float = np.inf

    def spend(self, unknowns: int, iterations: int) -> None:
        """Subtract from ``left`` what a solver has used: for each iteration, the cube of the number of unknowns."""
        self.left -= float(unknowns) ** 3 * iterations

    def check(self) -> None:
        """Raise ExhaustedError if the budget is used up."""
        if self.left <= 0:
            raise ExhaustedError("too large a contact for the work it may cost")


@dataclasses.dataclass(frozen=True)
class Pressing:
    """Solution of a contact's complementarity problem (``complement``).
    pressing : (k,) N, normal forces, 0 or more; active : (k,) bool, nodes that touch; step : m, the indenter's travel
    factor : (j, j), Cholesky factor of the matrix among the j active nodes"""

    pressing: np.ndarray
    active: np.ndarray
    step: float
    factor: np.ndarray


def complement(
    matrix: np.ndarray,
    gap: np.ndarray,
    active: np.ndarray,
    along: np.ndarray | None = None,
    force: float = 0.0,
    *,
    factors: dict[bytes, np.ndarray] | None = None,
) -> Pressing:
    """Find normal forces p >= 0 whose gaps g = matrix p + gap - step along are >= 0, with p g = 0, at every node.
    matrix : (k, k) m/N, symmetric, how forces open gaps; gap : (k,) m, without forces; active : (k,) bool, first guess
    along : (k,), by how much each gap closes per metre of ``step``, which is then found so that ``along . p`` is
        ``force``, N; None: ``step`` is 0
    factors : Cholesky factors of this matrix by active set, used and added to; None to keep none
    Raises UnsolvedError if the matrix is not positive definite, no node can carry the force, or exchanges do not end.
    """
    fewest, patience = len(gap) + 1, _PATIENCE
    pressing, step = np.zeros(len(gap)), 0.0
    for _ in range(_MOST_EXCHANGES):
        index = np.flatnonzero(active)
        if along is not None and not (len(index) and (along[index] > 0).any()):
            raise UnsolvedError("no node can carry the force")
        right = -gap[index] if along is None else np.column_stack([-gap[index], along[index]])
        factor, answer = _closed(matrix, active, index, right, factors)
        if along is not None:
            answer, per_step = answer.T
            step = float((force - along[index] @ answer) / (along[index] @ per_step))
            answer = answer + step * per_step
        pressing[:] = 0
        pressing[index] = answer
        open_gap = gap + matrix @ pressing
        if along is not None:
            open_gap -= step * along
        wrong = np.where(active, pressing < -FORCE_NOISE, open_gap < -_GAP_ROUNDING)
        count = int(wrong.sum())
        if not count:
            return Pressing(pressing, active, step, factor)
        if count < fewest:
            fewest, patience = count, _PATIENCE
        else:
            patience -= 1
        if patience < 0:
            wrong[: np.flatnonzero(wrong)[-1]] = False
        active = active ^ wrong
    raise UnsolvedError(f"the active set did not settle in {_MOST_EXCHANGES} exchanges")


def _closed(matrix, active, index, right, factors) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001
    """Return the Cholesky factor of a matrix's (n, n) block at ``index`` (j,), where ``active`` is true, and the
    block's solution of ``right`` (j, ...). factors : those found so far, by ``active``'s bytes; None to keep none"""
    from scipy.linalg import lapack

    known = factors.get(active.tobytes()) if factors is not None else None
    if not len(index):
        return matrix[:0, :0], right
    if known is not None:
        return known, lapack.dpotrs(known, right, lower=1)[0]
    every = len(index) == len(active)
    block = matrix if every else matrix.take(index, 0).take(index, 1)
    # LAPACK stores by columns: what it takes for the transposed matrix needs no copy.
    factor, answer, failed = lapack.dposv(block.T, right, lower=1, overwrite_a=not every)
    if failed:
        raise UnsolvedError("the compliance of the touching nodes is not positive definite")
    if factors is not None:
        factors[active.tobytes()] = factor
    return factor, answer
