"""The nodes that touch an obstacle: which, how hard, and whether they stick or slip."""

from __future__ import annotations

import dataclasses

import numpy as np

from .obstacle import Obstacle

_NO_WAY = np.zeros((0, 3))


@dataclasses.dataclass
class Touching:
    """Contact of candidate nodes with one obstacle; changes in place during a load step.

    candidates : (m,) mesh nodes that may touch; active, slipping : (m,) bool; anchor : (m, 3) m, in the indenter's
        frame, the place that a sticking node holds to, or that a slipping one has left; way : (m, 3), unit vector of
        the friction on a slipping node
    pressing : (k,) N, normal forces of the active nodes; rubbing : (k, 3) N, their friction, in the sensor's frame
    normals : (k, 3) of the obstacle there; imbalance : of friction, relative to the largest normal force
    """

    candidates: np.ndarray
    active: np.ndarray
    slipping: np.ndarray
    anchor: np.ndarray
    way: np.ndarray
    pressing: np.ndarray
    rubbing: np.ndarray
    normals: np.ndarray
    obstacle: Obstacle | None = None
    friction: float = 0.0
    imbalance: float = 0.0
    # Of the active nodes, as ``begin`` saw them: distance (k,) m, frames (k, 3, 3), and the way (k, 3) m to where they
    # stick; and the friction (k, 3) N that pulls those that slip.
    _distance: np.ndarray = dataclasses.field(default_factory=lambda: np.empty(0), repr=False)
    _frames: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 3, 3)), repr=False)
    _to_anchor: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 3)), repr=False)
    _pull: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 3)), repr=False)

    @classmethod
    def none(cls) -> Touching:
        """Nothing touches."""
        flags = np.zeros(0, bool)
        return cls(np.empty(0, int), flags, flags, _NO_WAY, _NO_WAY, np.empty(0), _NO_WAY, _NO_WAY)

    @property
    def nodes(self) -> np.ndarray:
        """(k,) mesh nodes that touch."""
        return self.candidates[self.active]

    @property
    def forces(self) -> np.ndarray:
        """(k, 3) N, of the obstacle on ``nodes``."""
        return self.pressing[:, None] * self.normals + self.rubbing

    @property
    def slips(self) -> bool:
        """Whether any touching node slips against friction."""
        return self.friction > 0 and bool((self.active & self.slipping).any())

    def gaps(self, at: np.ndarray) -> np.ndarray:
        """Gaps (m,) m of all candidates, negative in the obstacle; at (n, 3) m: the mesh's nodes."""
        return self.obstacle.distance(at[self.candidates])[0] if len(self.candidates) else np.empty(0)

    def carried(
        self,
        obstacle: Obstacle | None,
        candidates: np.ndarray,
        at: np.ndarray,
        friction: float = 0.0,
        first_share: float = 0.0,
    ) -> Touching:
        """The start of the next load step: what touched goes on, what the moved obstacle has reached begins.

        at : (n, 3) m, the mesh's nodes now. A slipping node's way is measured anew from where it is.
        first_share : where nothing touched, only nodes begin that overlap by this share of the largest overlap.
        """
        m = len(candidates)
        if obstacle is None or not m:
            return Touching.none()
        distance, normal = obstacle.distance(at[candidates])
        went, place = np.isin(candidates, self.nodes), np.searchsorted(self.nodes, candidates)
        share = 0.0 if went.any() else first_share
        active = went | (distance < min(share * distance.min(), 0.0))
        slipping, anchor, way, pressing = np.zeros(m, bool), np.zeros((m, 3)), np.zeros((m, 3)), np.zeros(m)
        rubbing = np.zeros((m, 3))
        pressing[went], rubbing[went] = self.pressing[place[went]], self.rubbing[place[went]]
        if friction:
            before = np.isin(candidates, self.candidates)
            old = np.searchsorted(self.candidates, candidates[before])
            slipping[before], way[before], anchor[before] = self.slipping[old], self.way[old], self.anchor[old]
            leaves = went & slipping
            if leaves.any():
                anchor[leaves] = self.obstacle.to_own(at[candidates[leaves]])
            fresh = active & ~went
            anchor[fresh] = obstacle.to_own((at[candidates] - distance[:, None] * normal)[fresh])
            slipping[~active] = False
        forces = pressing[active], rubbing[active]
        touching = Touching(candidates, active, slipping, anchor, way, *forces, normal[active], obstacle, friction)
        touching._pull = np.where((slipping & bool(friction))[active, None], touching.rubbing, 0.0)
        return touching

    def begin(self, at: np.ndarray) -> np.ndarray:
        """Look at the obstacle from where the nodes are; frames (k, 3, 3) with the normal as first axis.

        One tangent lies across the axis that the normal has least of: on a plane of symmetry that is its own.
        """
        if not len(self.candidates):
            self._distance, self._frames = np.empty(0), np.empty((0, 3, 3))
            return self._frames
        self._distance, self.normals = self.obstacle.distance(at[self.nodes])
        helper = np.eye(3)[np.argmin(np.abs(self.normals), axis=1)]
        first = np.cross(self.normals, helper)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        self._frames = np.stack([self.normals, first, np.cross(self.normals, first)], -1)
        self._to_anchor = np.zeros((len(self._distance), 3))
        if self.friction:
            self._to_anchor = self.obstacle.from_own(self.anchor[self.active]) - at[self.nodes]
            tangent = _tangential(self.way[self.active], self.normals)
            length = np.linalg.norm(tangent, axis=1, keepdims=True)
            self.way[self.active] = tangent / np.maximum(length, 1e-12)
            self._rub()
        return self._frames

    def _rub(self) -> None:
        """Friction of the slipping nodes from their normal forces."""
        slip = self.slipping[self.active]
        pull = self.friction * np.maximum(self.pressing, 0)[:, None] * self.way[self.active]
        self._pull = np.where(slip[:, None], pull, 0.0)

    def bending(self, at: np.ndarray) -> np.ndarray:
        """Change (k, 3, 3) N/m of the contact forces with the normals' turn: pressing times the Hessian.

        Taken where the nodes will come to lie, on the obstacle: near a centre of curvature, deep in it, it is no guide.
        """
        if not self.active.any():
            return np.empty((0, 3, 3))
        return self.pressing[:, None, None] * self.obstacle.curvature(
            at[self.nodes] - self._distance[:, None] * self.normals
        )

    def prescribe(self, fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Held degrees of freedom and their steps, both (k, 3) in the frames of ``begin``; fixed ones do not move."""
        held, step = fixed.copy(), np.zeros(fixed.shape)
        if not len(fixed):
            return held, step
        if self.friction:
            sticks = ~self.slipping[self.active]
            held[sticks] = True
            step[sticks] = np.einsum("kji,kj->ki", self._frames, self._to_anchor)[sticks]
        held[:, 0] = True
        step[:, 0] = -self._distance
        step[fixed] = 0.0
        return held, step

    def pull_in_frames(self) -> np.ndarray:
        """(k, 3) N, friction on slipping nodes in the frames of ``begin``."""
        if not self.slips:
            return np.zeros((int(self.active.sum()), 3))
        return np.einsum("kji,kj->ki", self._frames, self._pull)

    def follow(self, reaction: np.ndarray) -> None:
        """Let friction follow normal forces that have just been found; reaction (k, 3) N in frames."""
        if self.slips:
            self.pressing = reaction[:, 0].copy()
            before = self._pull
            self._rub()
            self.imbalance = float(np.abs(self._pull - before).max() / max(self.pressing.max(initial=0), 1e-12))

    def press(self, reaction: np.ndarray) -> None:
        """Keep the forces (k, 3) N, in frames, that hold the nodes."""
        self.pressing = reaction[:, 0].copy()
        if not self.friction:
            self.rubbing = np.zeros((len(reaction), 3))
            return
        held = np.einsum("kij,kj->ki", self._frames[:, :, 1:], reaction[:, 1:])
        self.rubbing = np.where(self.slipping[self.active][:, None], self._pull, held)

    def update(self, at: np.ndarray, tolerance: float, slip_stiffness: float) -> bool:
        """Release what is pulled, take in what is passed, and let stick and slip change; whether nothing had to.

        tolerance : m, of the gaps; slip_stiffness : N/m, weighs a slip against friction to find its direction
        """
        if not len(self.candidates):
            return True
        distance, normal = self.obstacle.distance(at[self.candidates])
        pressing, rubbing = np.zeros(len(distance)), np.zeros((len(distance), 3))
        pressing[self.active], rubbing[self.active] = self.pressing, self.rubbing
        release, enter = self.active & (pressing < 0), ~self.active & (distance < -tolerance)
        settled = not release.any() and not enter.any() and np.abs(distance[self.active]).max(initial=0) < tolerance
        if self.friction:
            settled &= self._stick_or_slip(at, normal, pressing, rubbing, slip_stiffness)
            self.anchor[enter] = self.obstacle.to_own((at[self.candidates] - distance[:, None] * normal)[enter])
            self.slipping[enter | release] = False
        active = (self.active & ~release) | enter
        self.normals = normal[active] if not settled else normal[self.active]
        self.active, self.pressing, self.rubbing = active, pressing[active], rubbing[active]
        return bool(settled)

    def _stick_or_slip(self, at, normal, pressing, rubbing, stiffness) -> bool:  # noqa: ANN001
        bound = self.friction * np.maximum(pressing, 0)
        size = np.linalg.norm(rubbing, axis=1)
        largest = max(float(pressing.max(initial=0)), 1e-12)
        breaks = self.active & ~self.slipping & (size > bound + _CONE_TOLERANCE * largest)
        left = _tangential(at[self.candidates] - self.obstacle.from_own(self.anchor), normal)
        way = _tangential(self.way, normal)
        slips = self.active & self.slipping
        holds = slips & (np.einsum("ki,ki->k", left, way) > _SLIP_TOLERANCE)
        # A slip far beyond what friction itself can spring back decides alone; a small one is weighed against the way.
        far = 1 + stiffness * np.linalg.norm(left, axis=1) / np.maximum(bound, 1e-30)
        turned = bound[:, None] * way - (stiffness * far)[:, None] * left
        length = np.linalg.norm(turned, axis=1)
        goes = slips & ~holds & (length > 1e-12 * largest)
        turned[goes] /= length[goes, None]
        swing = (np.abs(turned - way).max(axis=1) * bound / largest)[goes].max(initial=0.0)
        self.way[goes] = turned[goes]
        self.way[breaks] = rubbing[breaks] / np.maximum(size[breaks], 1e-30)[:, None]
        self.slipping = (self.slipping | breaks) & ~holds
        return not breaks.any() and not holds.any() and swing < _SWING_TOLERANCE


def _tangential(vectors: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return vectors - np.einsum("ki,ki->k", vectors, normal)[:, None] * normal


_CONE_TOLERANCE = 1e-6  # of the largest normal force: a sticking node may pass its cone by that much
_SLIP_TOLERANCE = 1e-9  # m, as the gaps': a slip against friction's own direction
_SWING_TOLERANCE = 1e-3  # of the largest normal force: a turn of a node's friction between iterations
