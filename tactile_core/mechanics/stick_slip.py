"""One Newton step of a contact with Coulomb friction, in the forces of all touching points at once.

A sticking node bears any force and may not move. A slipping node has two unknowns: its normal force, on which friction
leans, and the turn of friction across that; its gap closes, and friction stays opposite to the slip. Where the normal
turns as a slipping node moves along a curved indenter the force turns with it: its motion is unknown too.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from .active_set import UnsolvedError

_RIDGE = 1e-6  # relative, of the compliance: keeps single precision definite
_LARGEST_TURN = 1.0  # rad, of a slipping node's friction in one step
_LARGEST_TILT = 0.3  # rad, of a normal in one step
LEAST_FORCE = 1e-9  # N: below what single precision of the compliance resolves


@dataclasses.dataclass(frozen=True)
class Slipping:
    """Slipping nodes: numbers ``at`` (s,) among the touching ones, and what they do.

    normal, lean : (s, 3) unit vectors, of the indenter and of friction; pressing : (s,) N, normal forces
    slip : (s, 3) m, from their spots; moves : (s, 3) m, from where the normals were found
    bend : (s, 3, 3) 1/m, second derivatives of the indenter's distance; 0 where the turn of the normal is left out
    """

    at: np.ndarray
    normal: np.ndarray
    lean: np.ndarray
    pressing: np.ndarray
    slip: np.ndarray
    moves: np.ndarray
    bend: np.ndarray
    friction: float

    @functools.cached_property
    def across(self) -> np.ndarray:
        """(s, 3), unit vectors across the normal and friction."""
        return np.cross(self.normal, self.lean)

    @functools.cached_property
    def limit(self) -> np.ndarray:
        """(s,) N, of friction."""
        return self.friction * np.maximum(self.pressing, LEAST_FORCE)

    @functools.cached_property
    def curved(self) -> np.ndarray:
        """(c,), which of them have normals that turn."""
        return np.flatnonzero(self.bend.any(axis=(1, 2)))

    def turning(self) -> np.ndarray:
        """Change of the forces of the curved nodes (c, 3, 3) N/m with their motion, at the same normal forces."""
        at = self.curved
        follows = np.eye(3) - self.friction * self.normal[at][:, :, None] * self.lean[at][:, None, :]
        return self.pressing[at, None, None] * (follows @ self.bend[at])

    def forces(self, pressing: np.ndarray, turn: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """Forces (s, 3) N after a turn (s,) of friction and motion (c, 3) m of the curved nodes."""
        turn = np.clip(turn, -_LARGEST_TURN, _LARGEST_TURN)[:, None]
        normal, lean = self.normal.copy(), np.cos(turn) * self.lean + np.sin(turn) * self.across
        tilt = np.einsum("aij,aj->ai", self.bend[self.curved], motion)
        size = np.linalg.norm(tilt, axis=1, keepdims=True)
        normal[self.curved] += tilt * np.minimum(1, _LARGEST_TILT / np.maximum(size, 1e-12))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        lean -= np.einsum("ai,ai->a", lean, normal)[:, None] * normal
        lean /= np.linalg.norm(lean, axis=1, keepdims=True)
        return pressing[:, None] * (normal + self.friction * lean)


class Step:
    """The solved system of points ``index`` (m,) of a compliance: three axes of each touching node, then the core.

    away : (m,) m, by which nodes stand off their spots and gaps are open; along : (m,), how the indenter moves
    Raises UnsolvedError.
    """

    def __init__(
        self, compliance: np.ndarray, index: np.ndarray, away: np.ndarray, along: np.ndarray, slipping: Slipping
    ) -> None:
        self._slipping, self._three = slipping, 3 * slipping.at[:, None] + np.arange(3)
        self._kept = np.ones(len(index), bool)
        self._kept[self._three[:, 2]] = False
        matrix = compliance.take(index, 0).take(index, 1)
        matrix.flat[:: len(index) + 1] *= 1 + _RIDGE
        right, self._carry = np.column_stack([-away, along]), along
        if len(slipping.at):
            matrix, right, self._carry = self._reduced(matrix, right, along)
        self._answer = _solved(matrix, right, symmetric=not len(slipping.at))

    def step_for(self, missing: float) -> float:
        """By how far, m, the indenter moves for ``missing`` N more along its motion. Raises UnsolvedError."""
        carried, per_step = self._carry @ self._answer
        if not per_step > 0:
            raise UnsolvedError("no node can carry the force")
        return float((missing - carried) / per_step)

    def change(self, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Change (m,) N of forces as the indenter moves by ``step`` m, and new forces (s, 3) N of slipping nodes."""
        found = self._answer[:, 0] + step * self._answer[:, 1]
        count, change = int(self._kept.sum()), np.zeros(len(self._kept))
        change[self._kept] = found[:count]
        slipping, parts = self._slipping, change[self._three[:, :2]]
        pressing = slipping.pressing + parts[:, 0]
        return change, slipping.forces(pressing, parts[:, 1] / slipping.limit, found[count:].reshape(-1, 3))

    def _reduced(self, matrix, right, along):  # noqa: ANN001, ANN202
        """The system in the unknowns of slipping nodes, and how these carry force along the motion."""
        slipping, three, kept = self._slipping, self._three, self._kept
        two, curved = three[:, :2], three[slipping.curved]
        rows = np.stack([slipping.normal, slipping.across], axis=1)
        columns = np.stack([slipping.normal + slipping.friction * slipping.lean, slipping.across], axis=1)
        turning = slipping.turning()
        felt = np.einsum("mqi,qij->mqj", matrix[:, curved], turning).reshape(len(matrix), curved.size)
        carry = along.copy()
        carry[two] = np.einsum("ai,aji->aj", along[three], columns)
        carry = np.concatenate([carry[kept], np.einsum("qi,qij->qj", along[curved], turning).ravel()])
        matrix[:, two] = np.einsum("mai,aji->maj", matrix[:, three], columns)
        matrix = np.concatenate([matrix.take(np.flatnonzero(kept), 1), felt], axis=1)
        below = -matrix[curved.ravel()]
        below[np.arange(curved.size), kept.sum() + np.arange(curved.size)] += 1
        moves = np.column_stack([slipping.moves[slipping.curved].ravel(), -along[curved.ravel()]])
        matrix[two], right[two] = rows @ matrix[three], rows @ right[three]
        opposing = np.maximum(-np.einsum("ai,ai->a", slipping.slip, slipping.lean), 0)
        matrix[two[:, 1], np.cumsum(kept)[two[:, 1]] - 1] += opposing / slipping.limit
        return np.concatenate([matrix[kept], below]), np.concatenate([right[kept], moves]), carry


def _solved(matrix: np.ndarray, right: np.ndarray, *, symmetric: bool) -> np.ndarray:
    """What solves (j, j) for ``right`` (j, 2)."""
    from scipy.linalg import lapack

    if not len(matrix):
        return right
    if symmetric:
        _, answer, failed = lapack.sposv(matrix, right, lower=1)
    else:
        _, _, answer, failed = lapack.sgesv(matrix, right)
    if failed:
        raise UnsolvedError("the compliance of the touching nodes is not positive definite")
    return answer.astype(float)
