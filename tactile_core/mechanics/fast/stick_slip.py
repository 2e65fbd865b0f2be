"""Newton step of a contact with Coulomb friction, in the forces of all touching points at once.

A sticking node bears any force and may not move. A slipping node closes its gap, and two things are unknown: how far it
moves along friction, whose size its normal force decides, and the turn of friction across that, which stays opposite to
the slip. Where the normal turns as a slipping node moves along a curved indenter the force turns with it.

All motions but those of slipping nodes are known, and the stiffness of what touches (``contact_stiffness``) makes
forces of them: the system to be solved has two unknowns a slipping node, however many stick.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...geometry.indenters.indenter import lengths
from ...geometry.node_vectors import cross, dot
from .active_set import UnsolvedError
from .compliance_block import ComplianceBlock
from .contact_stiffness import ContactStiffness

LARGEST_TURN = 1.0  # rad, of a slipping node's friction in one step
LARGEST_TILT = 0.3  # rad, of a normal in one step
LEAST_FORCE = 1e-9  # N: below what single precision of the compliance resolves


@dataclasses.dataclass(frozen=True)
class Slipping:
    """Slipping nodes: numbers ``at`` (s,) among the block's, and what they do.

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

    @functools.cached_property
    def against(self) -> np.ndarray:
        """Slip (s,) m along friction, against its limit: how far a node moves across it under 1 N, m/N."""
        return np.maximum(-dot(self.slip, self.lean), 0) / self.limit

    @functools.cached_property
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
    """The solved Newton step of a block's ``active`` (k + c,) points.

    stiffness : of what touches, kept from step to step
    away : (k, 3) m, by which nodes stand off their spots and gaps are open; core_gap : (c,) m
    direction : (3,), in which the indenter moves; deepens : whether ``change`` may be asked to move it
    forces : (3 k + c, r) N, change of those on the block's points, and where it deepens that for a metre of motion
    Raises UnsolvedError.
    """

    def __init__(
        self, stiffness: ContactStiffness, block: ComplianceBlock, active: np.ndarray, away: np.ndarray,
        core_gap: np.ndarray, direction: np.ndarray, slipping: Slipping, *, deepens: bool,
    ) -> None:  # fmt: skip
        self._block, self._slipping, self._direction = block, slipping, direction
        self._inverse, self._rows = stiffness.among(block, active)
        surface = 3 * block.k
        motion = np.zeros((len(block.matrix), 2 if deepens else 1))
        motion[:surface, 0] = -away.ravel()
        motion[surface:, 0] = -core_gap
        if deepens:
            motion[:surface, 1].reshape(-1, 3)[:] = direction
        if len(slipping.at):
            self._slide(motion)
        self.forces = self._under(motion)
        self._bearing = self._borne(motion) if len(slipping.at) else None

    def change(self, force: np.ndarray, core: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Return forces (k, 3), (c,) N after the step, from those before it; step : m, of the indenter."""
        by, slipping, surface = np.array([1.0, step][: self.forces.shape[1]]), self._slipping, 3 * self._block.k
        found = self.forces @ by
        force, core = force + found[:surface].reshape(-1, 3), core + found[surface:]
        if self._bearing is not None:
            bearing, motion = (each @ by for each in self._bearing)
            pressing = slipping.pressing + dot(slipping.normal, bearing)
            force[slipping.at] = slipping.forces(pressing, self._turn @ by / slipping.limit, motion)
        return force, core

    def _under(self, motion: np.ndarray) -> np.ndarray:
        """Forces (3 k + c, r) N on the active points that move them by ``motion`` (3 k + c, r) m."""
        forces = np.zeros(motion.shape)
        forces[self._rows] = self._inverse @ motion[self._rows].astype(np.float32)
        return forces

    def _slide(self, motion: np.ndarray) -> None:
        """Let slipping nodes slip in ``motion`` (3 k + c, r) m as friction asks for."""
        slipping, count = self._slipping, len(self._slipping.at)
        of_nodes = motion[: 3 * self._block.k].reshape(self._block.k, 3, -1)
        lean, across = slipping.lean[:, :, None], slipping.across[:, :, None]
        held = of_nodes[slipping.at]
        held -= lean * (lean * held).sum(axis=1, keepdims=True)
        of_nodes[slipping.at] = held
        self.forces = self._under(motion)
        bearing, _ = self._borne(motion)
        law = slipping.lean - slipping.friction * slipping.normal
        right = -np.concatenate([np.einsum("ai,aij->aj", each, bearing) for each in (law, slipping.across)])
        answer = solved(self._system(law), right)
        along, self._turn = answer[:count, None], answer[count:]
        of_nodes[slipping.at] += lean * along - across * (slipping.against[:, None, None] * self._turn[:, None])

    def _borne(self, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find what slipping nodes bear, (s, 3, r) N, besides what turns with their normals, and curved ones' motion.

        motion : (3 k + c, r) m; the second (q, 3, r) m is relative to the indenter
        """
        slipping, columns = self._slipping, motion.shape[1]
        bearing = self.forces[: 3 * self._block.k].reshape(-1, 3, columns)[slipping.at]
        moved = np.zeros((len(slipping.curved), 3, columns))
        if len(slipping.curved):
            moved += motion[: 3 * self._block.k].reshape(-1, 3, columns)[slipping.at[slipping.curved]]
            moved[:, :, 0] += slipping.moves[slipping.curved]
            moved[:, :, 1:] -= self._direction[:, None]
            bearing[slipping.curved] -= slipping.turning @ moved
        return bearing, moved

    def _system(self, law: np.ndarray) -> np.ndarray:
        """Matrix (2 s, 2 s) float32 of the unknowns of slipping nodes; law : (s, 3), along which forces must vanish."""
        slipping, place = self._slipping, np.zeros(len(self._block.matrix), np.int64)
        place[self._rows] = np.arange(len(self._rows))
        at = place[3 * slipping.at]
        s, whole = len(at), (at[:, None] + np.arange(3)).ravel()
        blocks = self._inverse.take(whole, 0).take(whole, 1).reshape(s, 3, s, 3)
        blocks[slipping.curved, :, slipping.curved] -= slipping.turning
        rows = np.stack([law, slipping.across]).astype(np.float32)
        columns = np.stack([slipping.lean, -slipping.against[:, None] * slipping.across]).astype(np.float32)
        half = (rows[:, :, None] @ blocks.reshape(s, 3, 3 * s)).reshape(2, s, s, 3)
        system = np.einsum("pabj,rbj->parb", half, columns).reshape(2 * s, 2 * s)
        system.reshape(-1)[s * (2 * s + 1) :: 2 * s + 1] -= 1
        return np.ascontiguousarray(system)


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve the system (j, j) for ``right`` (j, r); overwrites the matrix. Raises UnsolvedError."""
    from scipy.linalg import lapack

    # LAPACK stores by columns: what it takes for the transposed matrix needs no copy.
    factor, pivots, failed = lapack.sgetrf(matrix.T, overwrite_a=1)
    if failed:
        raise UnsolvedError("no motion of the slipping nodes balances their forces")
    return lapack.sgetrs(factor, pivots, right, trans=1)[0].astype(float)
