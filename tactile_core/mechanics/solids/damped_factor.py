"""Factors of a solid's tangent, damped where the solid is unstable."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .finite_strain import FiniteStrainSolid
from .sparse_cholesky import NotPositiveDefiniteError, PatternFactor

# Assumed, of a node's own stiffness: the first damping tried, and the least worth keeping; most tries at one state.
_FIRST, _LEAST, _TRIES = 0.02, 5e-3, 6
_MOST_BENDING = 0.3  # of a node's own stiffness (assumed)


class DampedFactor:
    """The solver of one solid's tangents, with as much damping as they need to be positive definite.

    Where the solid is unstable (a node about to slide off a ridge) it is damped until it is not: Newton's iteration
    then follows it down to the next equilibrium. Only the way there depends on it.

    damping : of a node's own stiffness, in use now; stiffness : N/m, of the size of a node's own
    """

    def __init__(self, solid: FiniteStrainSolid, factor: PatternFactor) -> None:
        self._pattern, self._factor, self.damping = solid.pattern, factor, 0.0
        spacing = np.median(np.linalg.norm(np.diff(solid.mesh.nodes[solid.mesh.cells[:, :2]], axis=1), axis=-1))
        self.stiffness = float(solid.law.bulk * 0.05 * spacing)

    def relax(self) -> None:
        """Try with less damping from now on."""
        self.damping = self.damping / 4 if self.damping > _LEAST else 0.0

    def solver(self, blocks: np.ndarray, held: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Return a function from forces (n, 3) N to displacements (n, 3) m, which are zero where ``held`` (n, 3).

        blocks : of the tangent on the solid's pattern; the damping is added to them.
        Raises NotPositiveDefiniteError where even much damping is too little.
        """
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
            moved = np.zeros(force.size)
            moved[free] = fast(np.where(held, 0.0, force).ravel()[free, None])[:, 0]
            return moved.reshape(-1, 3)

        return solve


def held_back(bending: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the curvature terms (k, 3, 3) N/m, no larger than a share of their nodes' own stiffness (k, 3, 3).

    Where a node rides a ridge sharper than the mesh, the whole term would make the matrix indefinite; less of it costs
    iterations, not exactness.
    """
    size = np.abs(bending).max(axis=(1, 2))
    most = _MOST_BENDING * np.einsum("kii->k", stiffness) / 3
    return bending * np.minimum(1.0, most / np.maximum(size, 1e-30))[:, None, None]
