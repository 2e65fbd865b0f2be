"""The nodes that touch an obstacle, and the normal force and friction on each.

Coulomb friction by return mapping, as in elastoplasticity: a stiff spring at each touching node pulls toward its anchor
on the indenter, with mu times the normal force at most, and then drags the anchor along (J. Simo, T. Laursen, Computers
and Structures 42, 1992, 97-116). A sticking node moves by its spring's stretch, at most mu normal force / ``grip``.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Protocol

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ..fast.contact_state import first_contact

_NO_WAY = np.zeros((0, 3))


@dataclasses.dataclass
class ContactSet:
    """Contact of candidate nodes with one obstacle; changes in place during a load step.
    candidates : (m,) mesh nodes that may touch; active, slipping : (m,) bool, those that touch, and those that slip
    anchor : (m, 3) m, in the indenter's frame, the place to which a touching node's spring pulls it
    pressing : (k,) N, normal forces of the k active nodes, positive if they press
    rubbing : (k, 3) N, friction on them, in the sensor's frame; normals : (k, 3), out of the obstacle at them
    friction : Coulomb's coefficient; grip : N/m, stiffness of each spring
    imbalance : largest change of a node's friction in the last ``follow``, over the largest normal force"""

    candidates: np.ndarray
    active: np.ndarray
    slipping: np.ndarray
    anchor: np.ndarray
    pressing: np.ndarray
    rubbing: np.ndarray
    normals: np.ndarray
    obstacle: Any = None  # an ``Obstacle``, which every set with candidates has; friction is with a ``PlacedIndenter``
    friction: float = 0.0
    grip: float = 0.0
    imbalance: float = 0.0
    # Of the active nodes, at the last ``begin``: distance (k,) m, frames (k, 3, 3), pull (k, 3) N of springs that would
    # never slip, stiffness (k, 3, 3) N/m of friction.
    # Of all candidates: where (m, 3) m they stood in the indenter's frame when the load step began.
    _distance: np.ndarray = dataclasses.field(default_factory=lambda: np.empty(0), repr=False)
    _frames: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 3, 3)), repr=False)
    _trial: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 3)), repr=False)
    _gripping: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 3, 3)), repr=False)
    _stood: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 3)), repr=False)

    @classmethod
    def none(cls) -> ContactSet:
        """Return a set without candidates, for a body that nothing can touch."""
        flags = np.zeros(0, bool)
        return cls(np.empty(0, int), flags, flags, _NO_WAY, np.empty(0), _NO_WAY, _NO_WAY)

    @property
    def nodes(self) -> np.ndarray:
        """Mesh nodes (k,) that touch."""
        return self.candidates[self.active]

    @property
    def forces(self) -> np.ndarray:
        """Forces (k, 3) N of the obstacle on ``nodes``."""
        return self.pressing[:, None] * self.normals + self.rubbing

    @property
    def slips(self) -> bool:
        """Return true if any touching node slips against friction."""
        return self.friction > 0 and bool((self.active & self.slipping).any())

    def gaps(self, at: np.ndarray) -> np.ndarray:
        """Return gaps (m,) m of all candidates, negative in the obstacle. at : (n, 3) m, the mesh's nodes"""
        return self.obstacle.distance(at[self.candidates])[0] if len(self.candidates) else np.empty(0)

    def carried(
        self,
        obstacle: Obstacle | None,
        candidates: np.ndarray,
        at: np.ndarray,
        before: Pose | None = None,
        friction: float = 0.0,
        grip: float = 0.0,
        first_share: float = 0.0,
    ) -> ContactSet:
        """Return the set at the start of the next load step: nodes that touched, and those that the moved obstacle
        overlaps. Anchors of slipping nodes are dragged to where friction holds them.
        obstacle : at its new place; None: without contact. before : its pose until now, needed with friction
        candidates : (m,) mesh nodes that may touch; at : (n, 3) m, the mesh's nodes now
        friction, grip : of the new set, as in the class
        first_share : if nothing touched, only nodes enter that overlap by this share of the largest overlap"""
        m = len(candidates)
        if obstacle is None or not m:
            return ContactSet.none()
        distance, normal = obstacle.distance(at[candidates])
        went, place = np.isin(candidates, self.nodes), np.searchsorted(self.nodes, candidates)
        share = 0.0 if went.any() else first_share
        active = went | (distance < min(share * distance.min(), 0.0))
        slipping, anchor, pressing, rubbing = np.zeros(m, bool), np.zeros((m, 3)), np.zeros(m), np.zeros((m, 3))
        pressing[went], rubbing[went] = self.pressing[place[went]], self.rubbing[place[went]]
        if friction and before is not None and went.any():
            slipping[went] = self.slipping[self.active][place[went]]
            anchor[went] = before.to_own(at[candidates[went]] + rubbing[went] / grip)
        forces = pressing[active], rubbing[active]
        carried = ContactSet(candidates, active, slipping, anchor, *forces, normal[active], obstacle, friction, grip)
        if friction and before is not None:
            carried._stood = before.to_own(at[candidates])
            carried._tie(active & ~went, at)
        return carried

    def _tie(self, fresh: np.ndarray, at: np.ndarray) -> None:
        """Anchor those candidates where ``fresh`` (m,) bool is true at the point where the obstacle, moving in this
        load step, meets them. at : (n, 3) m, the mesh's nodes now"""
        last = self.obstacle.pose.to_own(at[self.candidates[fresh]])
        self.anchor[fresh] = first_contact(self.obstacle.indenter, self._stood[fresh], last)

    def begin(self, at: np.ndarray) -> np.ndarray:
        """Find gaps and normals of touching nodes for a Newton step; return frames (k, 3, 3), first column the normal.

        at : (n, 3) m, the mesh's nodes now. One tangent is perpendicular to the axis of the normal's smallest
            component, as mirror symmetry needs."""
        if not len(self.candidates):
            self._distance, self._frames = np.empty(0), np.empty((0, 3, 3))
            return self._frames
        self._distance, self.normals = self.obstacle.distance(at[self.nodes])
        helper = np.eye(3)[np.argmin(np.abs(self.normals), axis=1)]
        first = np.cross(self.normals, helper)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        self._frames = np.stack([self.normals, first, np.cross(self.normals, first)], -1)
        if self.friction:
            self._stretch(at)
            self._apply_friction()
        return self._frames

    def _stretch(self, at: np.ndarray) -> None:
        """Find the springs' pulls, N, if none slips, from the mesh's nodes ``at`` (n, 3) m, along the surface."""
        away = at[self.nodes] - self.obstacle.pose.from_own(self.anchor[self.active])
        self._trial = -self.grip * (away - np.einsum("ki,ki->k", away, self.normals)[:, None] * self.normals)

    def _apply_friction(self) -> None:
        """Compute friction from the normal forces and the springs."""
        self.rubbing, self.slipping[self.active] = self._capped(self._trial)

    def _capped(self, trial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Limit pulls ``trial`` (k, 3) N by friction; returns the limited pulls (k, 3), and which (k,) slip."""
        bound, size = self.friction * np.maximum(self.pressing, 0), np.linalg.norm(trial, axis=1)
        slips = size > bound
        return np.where(slips, bound / np.maximum(size, 1e-30), 1.0)[:, None] * trial, slips

    def slide_share(self, move: np.ndarray, force: float, stiffness: float) -> float:
        """Return the share, at most 1, of a step after which friction balances all other forces along it (line search).

        Newton's steps overshoot if many nodes begin to slip. move : (k, 3) m, of the nodes, in ``begin``'s frames
        force : N m, slope of the energy along the step at its start, without friction's; negative if it drives on
        stiffness : N m, what the whole step adds to that slope, friction's part as linearised by ``gripping`` included
        """
        if not self.friction:
            return 1.0
        along = np.einsum("kij,kj->ki", self._frames[:, :, 1:], move[:, 1:])

        stiffness -= float(np.einsum("ki,kij,kj->", along, self._gripping, along))

        def residual_force(share: float) -> float:
            """Return the derivative, N m, of the energy with respect to the share of the step."""
            rubbing, _ = self._capped(self._trial - share * self.grip * along)
            return force + share * stiffness - float((along * rubbing).sum())

        begin, end = residual_force(0.0), residual_force(1.0)
        if begin >= 0 or end <= _OVERSHOT * -begin:
            return 1.0
        low, high = 0.0, 1.0
        while high - low > _SHARE_STEP:
            middle = (low + high) / 2
            low, high = (middle, high) if residual_force(middle) < 0 else (low, middle)
        return high

    def bending(self, at: np.ndarray) -> np.ndarray:
        """Return the contact forces' stiffness (k, 3, 3) N/m from the turn of normals: ``pressing`` times the
        distance's Hessian. It is taken where touching nodes will lie on the obstacle's surface, as the curvature deep
        inside misleads. at : (n, 3) m, the mesh's nodes"""
        if not self.active.any():
            return np.empty((0, 3, 3))
        feet = at[self.nodes] - self._distance[:, None] * self.normals
        return self.pressing[:, None, None] * self.obstacle.curvature(feet)

    def gripping(self, along: float) -> np.ndarray:
        """Return friction's stiffness (k, 3, 3) N/m: of sticking springs, and of slipping ones across their pull.

        along : share of the secant stiffness that slipping springs have along their pull: 0 is Newton's method, more
            keeps nodes from alternating between stick and slip
        """
        self._gripping = np.zeros((int(self.active.sum()), 3, 3))
        if not self.friction:
            return self._gripping
        size = np.maximum(np.linalg.norm(self._trial, axis=1), 1e-30)
        slips = self.slipping[self.active]
        pull = np.where(slips[:, None], self._trial / size[:, None], 0.0)
        share = np.where(slips, np.linalg.norm(self.rubbing, axis=1) / size, 1.0)
        flat = np.eye(3) - self.normals[:, :, None] * self.normals[:, None, :]
        flat -= (1 - along) * pull[:, :, None] * pull[:, None, :]
        self._gripping = (self.grip * share)[:, None, None] * flat
        return self._gripping

    def prescribe(self, fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which axes (k, 3) bool of touching nodes are prescribed, and steps (k, 3) m along them, 0 along
        others: normal steps close gaps, steps along ``fixed`` (k, 3) bool axes are zero. All in ``begin``'s frames."""
        held, step = fixed.copy(), np.zeros(fixed.shape)
        if len(fixed):
            held[:, 0] = True
            step[:, 0] = -self._distance
            step[fixed] = 0.0
        return held, step

    def rubbing_in_frames(self) -> np.ndarray:
        """Return the friction (k, 3) N in the frames of ``begin``."""
        if not self.friction:
            return np.zeros((int(self.active.sum()), 3))
        return np.einsum("kji,kj->ki", self._frames, self.rubbing)

    def follow(self, reaction: np.ndarray) -> None:
        """Store the normal forces, and limit friction by them, if any node slips. reaction : as in ``press``"""
        if self.slips:
            self.pressing = reaction[:, 0].copy()
            before = self.rubbing
            self._apply_friction()
            self.imbalance = float(np.abs(self.rubbing - before).max() / max(self.pressing.max(initial=0), 1e-12))

    def press(self, reaction: np.ndarray) -> None:
        """Store the normal forces. reaction : (k, 3) N, of the obstacle on touching nodes, in ``begin``'s frames"""
        self.pressing = reaction[:, 0].copy()

    def update(self, at: np.ndarray, tolerance: float) -> bool:
        """Release touching nodes in tension and add others deeper in the obstacle than ``tolerance``, m. Return true if
        there were none and touching nodes' gaps are below it. at : (n, 3) m, the mesh's nodes now"""
        if not len(self.candidates):
            return True
        distance, normal = self.obstacle.distance(at[self.candidates])
        pressing = np.zeros(len(distance))
        pressing[self.active] = self.pressing
        release, enter = self.active & (pressing < 0), ~self.active & (distance < -tolerance)
        settled = not release.any() and not enter.any() and np.abs(distance[self.active]).max(initial=0) < tolerance
        if self.friction:
            self._tie(enter, at)
            self.slipping[enter | release] = False
        self.active = (self.active & ~release) | enter
        self.normals, self.pressing = normal[self.active], pressing[self.active]
        self.rubbing = np.zeros_like(self.normals)
        if self.friction:
            self._stretch(at)
            self._apply_friction()
        return bool(settled)


_OVERSHOT = 0.3  # share of a step's driving force that may be left against it at the step's end (assumed)
_SHARE_STEP = 1 / 64


class Obstacle(Protocol):
    """A rigid body in the sensor's frame that a surface may touch: an indenter, or a skin's core."""

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance (n,) m, positive outside, and unit normal (n, 3) at points (n, 3) m."""

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the second derivatives (n, 3, 3) 1/m of the distance at points (n, 3) m."""


@dataclasses.dataclass(frozen=True)
class PlacedIndenter:
    """An indenter at a pose, as an ``Obstacle``."""

    indenter: Indenter
    pose: Pose

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance (n,) m, positive outside, and unit normal (n, 3) at points (n, 3) m."""
        return self.pose.distance(self.indenter, points)

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's second derivatives (n, 3, 3) 1/m at points (n, 3) m."""
        return self.pose.curvature(self.indenter, points)
