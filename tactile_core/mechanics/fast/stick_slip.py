"""Newton step of a contact with Coulomb friction, in the forces of all touching points at once.

A sticking node bears any force and may not move. A slipping node has two unknowns: its normal force, on which friction
leans, and the turn of friction across that; its gap closes, and friction stays opposite to the slip. Where the normal
turns as a slipping node moves along a curved indenter the force turns with it: its motion is unknown too.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...geometry.indenters.indenter import lengths
from .active_set import UnsolvedError
from .mirror_symmetry import axes_of
from .node_vectors import cross, dot, weighted

RIDGE = 1e-6  # relative, of the compliance: keeps single precision definite
LARGEST_TURN = 1.0  # rad, of a slipping node's friction in one step
LARGEST_TILT = 0.3  # rad, of a normal in one step
LEAST_FORCE = 1e-9  # N: below what single precision of the compliance resolves


@dataclasses.dataclass(frozen=True)
class Slipping:
    """Slipping nodes: numbers ``at`` (s,) among the touching ones, and what they do.

    normal, lean : (s, 3) unit vectors, of the indenter and of friction; pressing : (s,) N, normal forces
    slip : (s, 3) m, from their spots; moves : (s, 3) m, from where the normals were found
    curved : (c,), which of them have normals that turn; bend : (c, 3, 3) 1/m, second derivatives of the distance there
    """

    at: np.ndarray
    normal: np.ndarray
    lean: np.ndarray
    pressing: np.ndarray
    slip: np.ndarray
    moves: np.ndarray
    curved: np.ndarray
    bend: np.ndarray
    friction: float

    @functools.cached_property
    def across(self) -> np.ndarray:
        """Unit vectors (s, 3) across the normal and friction."""
        return cross(self.normal, self.lean)

    @functools.cached_property
    def limit(self) -> np.ndarray:
        """Limit (s,) N of friction."""
        return self.friction * np.maximum(self.pressing, LEAST_FORCE)

    def turning(self) -> np.ndarray:
        """Return the change (c, 3, 3) N/m of curved nodes' forces with their motion, at the same normal forces."""
        at = self.curved
        follows = np.eye(3) - self.friction * self.normal[at][:, :, None] * self.lean[at][:, None, :]
        return self.pressing[at, None, None] * (follows @ self.bend)

    def forces(self, pressing: np.ndarray, turn: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """Return the forces (s, 3) N after a turn (s,) of friction and motion (c, 3) m of the curved nodes."""
        turn = np.minimum(np.maximum(turn, -LARGEST_TURN), LARGEST_TURN)[:, None]
        normal, lean = self.normal, np.cos(turn) * self.lean + np.sin(turn) * self.across
        if len(self.curved):
            tilt = (self.bend @ motion[:, :, None])[:, :, 0]
            normal = normal.copy()
            normal[self.curved] += tilt * np.minimum(1, LARGEST_TILT / np.maximum(lengths(tilt), 1e-12))[:, None]
            normal /= lengths(normal)[:, None]
            lean -= dot(lean, normal)[:, None] * normal
            lean /= lengths(lean)[:, None]
        return pressing[:, None] * (normal + self.friction * lean)


class Step:
    """The solved system of a block's touching points: ``at`` (a,) nodes, and ``core`` (d,) rows of its matrix.

    compliance : (m, m) float32 m/N, of the block
    away : (a, 3) m, by which nodes stand off their spots and gaps are open; core_gap : (d,) m
    direction : (3,), in which the indenter moves
    sticks : (a,) bool, the nodes that do not slip
    Unknown are the forces of the t sticking nodes (3 t), those of the core (d), the normal forces of slipping nodes (s)
    and the turn of their friction (s), and the motion of curved ones. Raises UnsolvedError.
    """

    def __init__(
        self, compliance: np.ndarray, at: np.ndarray, core: np.ndarray, away: np.ndarray, core_gap: np.ndarray,
        direction: np.ndarray, slipping: Slipping,
    ) -> None:  # fmt: skip
        self._slipping, self._direction = slipping, direction
        self.sticks = np.ones(len(at), bool)
        self.sticks[slipping.at] = False
        stuck, slips = at[self.sticks], 3 * at[slipping.at]
        self._stuck, self._whole, s = 3 * len(stuck), 3 * len(stuck) + len(core), len(slips)
        index = np.concatenate([axes_of(stuck), core, slips, slips + 1, slips + 2])
        matrix = compliance.take(index, 0).take(index, 1)
        matrix.reshape(-1)[:: len(index) + 1] *= 1 + RIDGE
        right = np.zeros((len(index), 2))
        right[: self._stuck, 0] = -away[self.sticks].ravel()
        right[: self._stuck, 1].reshape(-1, 3)[:] = direction
        right[self._stuck : self._whole, 0] = -core_gap
        right[self._whole :, 0].reshape(3, s)[:] = -away[slipping.at].T
        right[self._whole :, 1].reshape(3, s)[:] = direction[:, None]
        self._carry = right[:, 1]
        if s:
            matrix, right, self._carry = self._reduced(matrix, right)
        self._answer = solved(matrix, right, symmetric=not s)

    def step_for(self, missing: float) -> float:
        """Return how far, m, the indenter moves for ``missing`` N more along its motion. Raises UnsolvedError."""
        carried, per_step = self._carry @ self._answer
        if not per_step > 0:
            raise UnsolvedError("no node can carry the force")
        return float((missing - carried) / per_step)

    def change(self, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return force changes of sticking nodes (t, 3) N and core (d,) N, and slipping nodes' new forces (s, 3) N."""
        found = self._answer[:, 0] + step * self._answer[:, 1]
        slipping = self._slipping
        s, unknown = len(slipping.at), found[self._whole :]
        pressing, turn, motion = unknown[:s], unknown[s : 2 * s], unknown[2 * s :]
        forces = slipping.forces(slipping.pressing + pressing, turn / slipping.limit, motion.reshape(-1, 3))
        return found[: self._stuck].reshape(-1, 3), found[self._stuck : self._whole], forces

    def _reduced(self, matrix: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The system in the unknowns of slipping nodes, and how these carry force along the motion."""
        slipping, n, s, m = self._slipping, self._whole, len(self._slipping.at), len(matrix)
        rows, columns = np.empty((2, 3, 2, s))
        rows[:, 0], columns[:, 0] = slipping.normal.T, (slipping.normal + slipping.friction * slipping.lean).T
        rows[:, 1] = columns[:, 1] = slipping.across.T
        q = 3 * len(slipping.curved)
        total = n + 2 * s + q
        among = np.empty((m + q, total), np.float32)  # the rows of the motion come to stand after those of the turn
        among[:m, :n] = matrix[:, :n]
        on_slips = matrix[:, n:].reshape(m, 3, s).swapaxes(0, 1)
        among[:m, n : n + 2 * s].reshape(m, 2, s)[:] = weighted(on_slips[:, :, None], columns)
        carry = np.concatenate([right[:n, 1], self._direction @ columns.reshape(3, -1)])
        reduced = np.empty((total, 2))
        if q:
            self._add_motion(among, on_slips)
            carry = np.concatenate([carry, (self._direction @ slipping.turning()).ravel()])
            below = -among[(n + slipping.curved[:, None] + s * np.arange(3)).ravel()]
            below.reshape(-1)[n + 2 * s :: total + 1] += 1
            reduced[n + 2 * s :, 0] = slipping.moves[slipping.curved].ravel()
            reduced[n + 2 * s :, 1].reshape(-1, 3)[:] = -self._direction
        among[n : n + 2 * s].reshape(2, s, total)[:] = weighted(among[n:m].reshape(3, 1, s, total), rows[..., None])
        if q:
            among[n + 2 * s : total] = below
        against = np.maximum(-dot(slipping.slip, slipping.lean), 0) / slipping.limit
        among.reshape(-1)[(n + s) * (total + 1) : (n + 2 * s) * (total + 1) : total + 1] += against
        reduced[:n] = right[:n]
        reduced[n : n + 2 * s] = (rows[..., None] * right[n:].reshape(3, 1, s, 2)).sum(axis=0).reshape(-1, 2)
        return among[:total], reduced, carry

    def _add_motion(self, among: np.ndarray, on_slips: np.ndarray) -> None:
        """Add what the motion of curved nodes does by turning their forces, as the last columns of ``among``."""
        at, turning = self._slipping.curved, self._slipping.turning()
        felt = weighted(on_slips[:, :, at, None], turning.swapaxes(0, 1)[:, None])
        among[: on_slips.shape[1], -3 * len(at) :].reshape(-1, len(at), 3)[:] = felt


def solved(matrix: np.ndarray, right: np.ndarray, *, symmetric: bool) -> np.ndarray:
    """Solve the system (j, j) for ``right`` (j, 2); overwrites the matrix. Raises UnsolvedError."""
    from scipy.linalg import lapack

    if not len(matrix):
        return right
    # LAPACK stores by columns: what it takes for the transposed matrix needs no copy.
    if symmetric:
        _, answer, failed = lapack.sposv(matrix.T, right, lower=1, overwrite_a=1)
    else:
        factor, pivots, failed = lapack.sgetrf(matrix.T, overwrite_a=1)
        answer = right if failed else lapack.sgetrs(factor, pivots, right, trans=1)[0]
    if failed:
        raise UnsolvedError("the compliance of the touching nodes is not positive definite")
    return answer.astype(float)
