"""Sparse Cholesky factor of a stiffness matrix: cholespy where it is installed, SciPy's SuperLU otherwise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


class NotPositiveDefiniteError(ValueError):
    """The matrix has no Cholesky factor: the solid is unstable at this state, or the step was too large."""


_BATCH = 128  # right-hand sides cholespy takes at once


def factor(matrix) -> Callable[[np.ndarray], np.ndarray]:  # noqa: ANN001 (scipy sparse, imported lazily)
    """A function that solves ``matrix @ x = b`` for b (n, k), float64. ``matrix``: symmetric positive definite CSC.

    Raises NotPositiveDefiniteError where cholespy finds that it is not; SuperLU does not look.
    """
    try:
        import cholespy
    except ImportError:
        return _superlu(matrix)
    pattern = matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32)
    try:
        solver = cholespy.CholeskySolverD(matrix.shape[0], *pattern, matrix.data, cholespy.MatrixType.CSC)
    except ValueError as error:
        raise NotPositiveDefiniteError(str(error)) from error

    def solve(b: np.ndarray) -> np.ndarray:
        x = np.empty_like(b)
        for start in range(0, b.shape[1], _BATCH):
            part = np.ascontiguousarray(b[:, start : start + _BATCH])
            answer = np.zeros_like(part)
            solver.solve(part, answer)
            x[:, start : start + _BATCH] = answer
        return x

    return solve


def _superlu(matrix) -> Callable[[np.ndarray], np.ndarray]:  # noqa: ANN001
    import scipy.sparse.linalg

    return scipy.sparse.linalg.splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    ).solve
