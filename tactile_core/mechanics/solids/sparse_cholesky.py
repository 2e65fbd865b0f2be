"""Sparse Cholesky factors of stiffness matrices, by the fastest library that is installed.

For many right-hand sides of one matrix: cholespy, else SciPy's SuperLU. For many matrices of one pattern: MKL's PARDISO
(pypardiso), which keeps the symbolic analysis, else the two above. With it a factorisation was ten times faster.
"""

from __future__ import annotations

import os
import pathlib
import sys
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .finite_strain import FiniteStrainSolid


class NotPositiveDefiniteError(ValueError):
    """Error for a matrix without Cholesky factor: the solid is unstable at this state, or the step was too large."""


_BATCH = 128  # right-hand sides cholespy takes at once


def factor(matrix) -> Callable[[np.ndarray], np.ndarray]:  # noqa: ANN001 (scipy sparse, imported lazily)
    """Return a function that solves ``matrix @ x = b``, b (n, k) float64, for a symmetric positive definite CSC matrix.

    Raises NotPositiveDefiniteError if cholespy finds that it is not; SuperLU does not check.
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
        """Return the solution for b (n, k), in parts that cholespy takes, copied since it wants contiguous rows."""
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


class PatternFactor:
    """Factors of symmetric positive definite matrices of one sparsity pattern."""

    def __init__(self) -> None:
        self._pardiso = _pardiso()
        self._analysed: tuple[np.ndarray, np.ndarray] | None = None  # the pattern, whose analysis PARDISO keeps

    def __call__(self, upper) -> Callable[[np.ndarray], np.ndarray]:  # noqa: ANN001 (scipy CSR)
        """Return a function that solves ``matrix @ x = b`` for b (n, k); valid until the next call.

        upper : the matrix's upper triangle, sorted, with the whole diagonal. Raises NotPositiveDefiniteError."""
        if self._pardiso is None:
            import scipy.sparse

            return factor((upper + scipy.sparse.triu(upper, 1).T).tocsc())
        # Compared by value: SciPy wraps the index arrays again for every matrix.
        pattern, nothing = (upper.indptr, upper.indices), np.zeros((upper.shape[0], 1))
        if self._analysed is None or not all(map(np.array_equal, self._analysed, pattern)):
            self._analysed = None
            self._run(upper, nothing, _ANALYSE)
            self._analysed = pattern
        self._run(upper, nothing, _FACTORISE)
        return lambda b: self._run(upper, np.asfortranarray(b, np.float64), _SOLVE)

    def _run(self, upper, b: np.ndarray, phase: int) -> np.ndarray:  # noqa: ANN001
        import pypardiso

        self._pardiso.set_phase(phase)
        try:
            return self._pardiso._call_pardiso(upper, b)
        except pypardiso.pardiso_wrapper.PyPardisoError as error:
            self._analysed = None  # PARDISO hangs when it factorises again after an error without a new analysis
            if error.value == _NOT_POSITIVE:
                raise NotPositiveDefiniteError("PARDISO met a pivot that is not positive") from error
            if error.value == _NO_MEMORY:
                raise MemoryError(f"PARDISO has no memory for {upper.shape[0]} unknowns") from error
            raise

    def __del__(self) -> None:
        if self._pardiso is not None and self._analysed is not None and not sys.is_finalizing():
            self._pardiso.free_memory(everything=True)


# Numbers of PARDISO: phases, error codes, matrix type (oneMKL reference).
_ANALYSE, _FACTORISE, _SOLVE = 11, 22, 33
_NOT_POSITIVE, _NO_MEMORY = -4, -2
_SYMMETRIC_POSITIVE_DEFINITE = 2


def _pardiso():  # noqa: ANN202
    """Return a PARDISO solver, or None if pypardiso is missing or finds no MKL."""
    try:
        import pypardiso

        # Given the place of MKL, pypardiso does not search the whole environment for it: a second each time.
        for path in sorted(pathlib.Path(sys.prefix, "lib").glob("libmkl_rt.so*")):
            os.environ.setdefault("PYPARDISO_MKL_RT", str(path))
        solver = pypardiso.PyPardisoSolver(mtype=_SYMMETRIC_POSITIVE_DEFINITE)
        solver.iparm[[0, 1, 9]] = 1, 2, 8  # own settings: nested dissection, no refinement (it takes most of a solve)
    except (ImportError, OSError):
        return None
    return solver


# First and least damping over a node's own stiffness; most tries at one state (assumed).
_FIRST, _LEAST, _TRIES = 0.02, 5e-3, 6
_MOST_BENDING = 0.3  # of a node's own stiffness (assumed)


class DampedFactor:
    """Solver for one solid's tangents, which adds as much damping as makes them positive definite.
    Through an unstable state (a node about to slide off a ridge) Newton's iteration then goes on to the next
    equilibrium, which does not depend on the damping.

    factor : solver for the solid's sparsity pattern
    damping : added to each node's own stiffness, as a multiple of ``stiffness``, N/m, that of a typical node"""

    def __init__(self, solid: FiniteStrainSolid, factor: PatternFactor) -> None:
        self._pattern, self._factor, self.damping = solid.pattern, factor, 0.0
        spacing = np.median(np.linalg.norm(np.diff(solid.mesh.nodes[solid.mesh.cells[:, :2]], axis=1), axis=-1))
        self.stiffness = float(solid.law.bulk * 0.05 * spacing)

    def relax(self) -> None:
        """Reduce the damping for the next matrix, once a step has succeeded."""
        self.damping = self.damping / 4 if self.damping > _LEAST else 0.0

    def solver(self, blocks: np.ndarray, held: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Return a function from forces (n, 3) N to displacements (n, 3) m, which are zero where held (n, 3) bool.

        blocks : (n_blocks, 3, 3) N/m, of the tangent in the pattern's order; damping is added to them in place.
        Raises NotPositiveDefiniteError if even much damping is too little."""
        free, pattern = self._pattern.free, self._pattern
        for _ in range(_TRIES):
            blocks[pattern.diagonal] += self.damping * self.stiffness * np.eye(3)
            try:
                fast = self._factor(pattern.upper(blocks, held.ravel()[free]))
                break
            except NotPositiveDefiniteError:
                blocks[pattern.diagonal] -= self.damping * self.stiffness * np.eye(3)
                self.damping = max(4 * self.damping, _FIRST)
        else:
            raise NotPositiveDefiniteError("the solid is unstable, damped or not")

        def solve(force: np.ndarray) -> np.ndarray:
            """Return the displacements (n, 3) m of all nodes under force (n, 3) N on those that are not held."""
            moved = np.zeros(force.size)
            moved[free] = fast(np.where(held, 0.0, force).ravel()[free, None])[:, 0]
            return moved.reshape(-1, 3)

        return solve


def held_back(bending: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the curvature terms ``bending`` (k, 3, 3) N/m, cut to 0.3 of their nodes' stiffness (k, 3, 3) N/m.

    At a ridge sharper than the mesh the whole term would make the matrix indefinite; less of it only costs steps."""
    size = np.abs(bending).max(axis=(1, 2))
    most = _MOST_BENDING * np.einsum("kii->k", stiffness) / 3
    return bending * np.minimum(1.0, most / np.maximum(size, 1e-30))[:, None, None]


class LinearSystem(NamedTuple):
    """Linear system of a Newton step, in the frames of the nodes that touch.
    solve : function from forces (n, 3) N to steps (n, 3) m of what is not held; matrix : sparse (3 n, 3 n) N/m
    residual : (n, 3) N, internal minus outer forces; prescribed : (n, 3) m, steps of what is held, 0 elsewhere
    loose_swell : (n, 3) m2, gradient of the fluid's volume, 0 at what is held
    excess : m3, by which the fluid's volume exceeds its true one"""

    solve: Callable[[np.ndarray], np.ndarray]
    matrix: Any
    residual: np.ndarray
    prescribed: np.ndarray
    loose_swell: np.ndarray
    excess: float
