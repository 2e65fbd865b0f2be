"""Tangential forces of nodes that stick, or slip with all their friction spent, for given normal forces.

The forces minimise a quadratic energy within one disc a node. Sticking nodes are free inside; a slipping node moves
along its circle, where the slip adds |slip| / limit to the stiffness: Newton's method there, symmetric positive
definite.
"""

from __future__ import annotations

import numpy as np

from .active_set import UnsolvedError

SLIP_TOLERANCE = 0.05e-6  # m, motion of a sticking node that counts as none: a quarter of the gaps' tolerance
_MOST_ITERATIONS = 60
_RIDGE = 1e-6  # relative, of the compliance: keeps single precision definite
_LARGEST_TURN = 1.0  # rad, of a slipping node's force in one iteration
_BEYOND = 1e-9  # relative, by which a sticking force may pass its limit before the node slips


def hold(
    compliance: np.ndarray, free: np.ndarray, limit: np.ndarray, force: np.ndarray, slips: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n, 2) N with |force| <= limit (n,), and which nodes (n,) bool slip, against their force.

    compliance : (2 n, 2 n) m/N; free : (n, 2) m, slip without force; force, slips : first guesses
    Raises UnsolvedError.
    """
    n = len(limit)
    matrix = compliance.copy()
    matrix.flat[:: 2 * n + 1] *= 1 + _RIDGE
    size = np.hypot(*force.T)
    slips = slips & (size > 0)
    force = np.where(slips[:, None], force * (limit / np.where(size > 0, size, 1))[:, None], force)
    for _ in range(_MOST_ITERATIONS):
        slip = free + (matrix @ force.ravel()).reshape(n, 2)
        direction = force / np.where(slips, limit, 1)[:, None]
        along = np.einsum("aj,aj->a", slip, direction)
        back = slips & (along > SLIP_TOLERANCE)
        slips = slips & ~back
        across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
        wrong = np.where(slips, np.abs(np.einsum("aj,aj->a", slip, across)), np.hypot(*slip.T))
        if wrong.max(initial=0.0) < SLIP_TOLERANCE and not back.any():
            return force, slips
        change, failed = _newton(matrix, slip, slips, across, np.maximum(-along, 0) / limit)
        if failed:
            raise UnsolvedError("the tangential compliance is not positive definite")
        turned = np.clip(change[:, 0], -_LARGEST_TURN * limit, _LARGEST_TURN * limit)
        force = force + np.where(slips[:, None], turned[:, None] * across, change)
        size = np.hypot(*force.T)
        over = slips | (size > limit * (1 + _BEYOND))
        force = np.where(over[:, None], force * (limit / np.where(size > 0, size, 1))[:, None], force)
        slips = over
    raise UnsolvedError("stick and slip did not settle")


def _newton(matrix, slip, slips, across, curved) -> tuple[np.ndarray, int]:  # noqa: ANN001
    """Change of force (n, 2): both components of sticking nodes, of slipping ones first that ``across`` and then 0."""
    from scipy.linalg import lapack

    n = len(slips)
    goal = slip.copy()
    if slips.any():
        turn = np.where(slips[:, None, None], np.stack([across, across[:, ::-1] * [-1, 1]], axis=1), np.eye(2))
        goal = np.einsum("aij,aj->ai", turn, slip)
        matrix = _turned(_turned(matrix, turn).T, turn)
        matrix.flat[:: 4 * n + 2] += np.where(slips, curved, 0)
    index = np.flatnonzero(np.column_stack([np.ones(n, bool), ~slips]))
    block = matrix if len(index) == 2 * n else matrix.take(index, 0).take(index, 1)
    _, answer, failed = lapack.dposv(block, -goal.ravel()[index], lower=1)
    change = np.zeros(2 * n)
    change[index] = answer
    return change.reshape(n, 2), failed


def _turned(matrix: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Rows of a (2 n, m) matrix in bases (n, 2, 2) of their own."""
    first, second = matrix[0::2], matrix[1::2]
    answer = np.empty_like(matrix)
    answer[0::2] = turn[:, 0, :1] * first + turn[:, 0, 1:] * second
    answer[1::2] = turn[:, 1, :1] * first + turn[:, 1, 1:] * second
    return answer
