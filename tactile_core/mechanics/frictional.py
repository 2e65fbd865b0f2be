"""Contact with Coulomb friction: nodes stick to the spot of the indenter where they landed until friction is spent.

Two exact solves take turns: normal forces with the tangential ones held (a linear complementarity problem), and
tangential forces within the discs that the normal forces allow (Newton's method on stick and slip). P.
Panagiotopoulos, Ingenieur- Archiv 44, 1975.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ..indenters import Indenter, Pose
from .active_set import Pressing, complement
from .frictionless import FORCE_TOLERANCE, GAP_TOLERANCE, SIDEWAYS_TOLERANCE, Pace, Try
from .near_block import NearBlock
from .stick_slip import hold

MAX_ITERATIONS = 60
_LARGEST_STEP = 0.25e-3  # m, of the depth in one iteration
_STALE = 0.03  # rad: compliances are made anew when a normal has turned by more


class Frictional:
    """Solves for the nodes of one block.

    rest : (k, 3) m; core_gap : (c,) m; spots : (k, 3) m, where nodes stick, in the indenter's frame
    """

    def __init__(
        self, block: NearBlock, rest: np.ndarray, core_gap: np.ndarray, indenter: Indenter, pose: Pose,
        spots: np.ndarray, friction: float,
    ) -> None:  # fmt: skip
        self.block, self.rest, self.core_gap = block, rest, core_gap
        self.indenter, self.pose, self.spots, self.friction = indenter, pose, spots, friction

    def solve(self, begin: Try, axial_force: float | None) -> Try:
        """From a first guess to the contact at its depth, or at a force along the motion, N. Raises UnsolvedError."""
        k, state = self.block.k, begin
        tangential, slips = np.zeros((k, 3)), np.zeros(k, bool)
        place = state.displacement
        gap, normal = self.pose.moved(state.shift).distance(self.indenter, self.rest + place)
        basis, pace, known = None, Pace(), np.zeros(k + self.block.c)
        for iteration in range(1, MAX_ITERATIONS + 1):
            basis = Basis.at(self.block, normal, basis)
            tangential = basis.in_plane(tangential)
            held = np.where(slips[:, None], 0.0, tangential)
            lean = basis.lean(np.where(slips[:, None], tangential, 0.0), self.friction)
            leaning = normal + basis.in_space(lean)
            moved, core_moved = self.block.respond(known[:k, None] * leaning + held, known[k:])
            now = np.r_[gap + np.einsum("ai,ai->a", normal, moved - place), self.core_gap + core_moved]
            solved = self._complement(basis, lean, now, known, state.active, axial_force, held)
            known = solved.pressing
            shift, pressing, core = state.shift + solved.step, known[:k], known[k:]
            there = self.pose.moved(shift)
            tangential = held + pressing[:, None] * (leaning - normal)
            moved, _ = self.block.respond(pressing[:, None] * normal + tangential, core)
            away = self.rest + moved - (there.apex + self.spots @ there.axes.T)
            tangential, slips = basis.hold(away, self.friction * pressing, tangential, slips)
            force = pressing[:, None] * normal + tangential
            displacement, _ = self.block.respond(force, core)
            gap, turned = there.distance(self.indenter, self.rest + displacement)
            state = Try(displacement, force, core, shift, solved.active, iterations=iteration, slipping=slips)
            state.settled = self._settled(state, gap, turned, normal, axial_force)
            if state.settled:
                return state
            trust = pace.after(gap, state.active[:k])
            place = place + trust * (displacement - place)
            gap, normal = (gap, turned) if trust == 1 else there.distance(self.indenter, self.rest + place)
        return state

    def _complement(self, basis, lean, now, known, active, axial_force, held) -> Pressing:  # noqa: ANN001
        """Normal forces while sticking nodes bear ``held`` and slipping ones bear ``lean`` times their normal force.

        now : (k + c,) m, gaps under the forces ``known`` (k + c,) N
        """
        matrix = basis.leaning(lean)
        offset = now - matrix @ known
        if axial_force is None:
            return complement(matrix, offset, active, symmetric=False)
        none = np.zeros(self.block.c)
        along = np.r_[basis.normal @ self.pose.direction, none]
        carry = np.r_[(basis.normal + basis.in_space(lean)) @ self.pose.direction, none]
        force = axial_force - float((held @ self.pose.direction).sum())
        solved = complement(matrix, offset, active, along, carry, force, symmetric=False)
        if abs(solved.step) <= _LARGEST_STEP:
            return solved
        step = float(np.clip(solved.step, -_LARGEST_STEP, _LARGEST_STEP))
        return dataclasses.replace(complement(matrix, offset - step * along, solved.active, symmetric=False), step=step)

    def _settled(self, state: Try, gap, turned, normal, axial_force) -> bool:  # noqa: ANN001
        active = state.active[: len(gap)]
        if not active.any():
            return bool((gap > -GAP_TOLERANCE).all()) and axial_force is None
        if gap.min() < -GAP_TOLERANCE or np.abs(gap[active]).max() > GAP_TOLERANCE:
            return False
        size = np.linalg.norm(state.force.sum(0))
        if np.linalg.norm((turned - normal) * np.linalg.norm(state.force, axis=1)[:, None]) > SIDEWAYS_TOLERANCE * size:
            return False
        axial = float(state.force.sum(0) @ self.pose.direction)
        return axial_force is None or abs(axial - axial_force) <= FORCE_TOLERANCE * abs(axial_force)


class Responses:
    """Compliances along normals (k, 3) and two tangents (k, 2, 3), each made when it is first asked for."""

    def __init__(self, block: NearBlock, normal: np.ndarray, tangents: np.ndarray) -> None:
        self.block, self.normal_then, self.tangents = block, normal, tangents

    @functools.cached_property
    def normal(self) -> np.ndarray:
        """(k + c, k + c) m/N, of the gaps under normal forces."""
        return self.block.normal(self.normal_then)

    @functools.cached_property
    def along(self) -> np.ndarray:
        """(2 k, 2 k) m/N, along the tangents under forces along the tangents."""
        k = self.block.k
        along = np.empty((k, 2, k, 2))
        for i, j in ((0, 0), (0, 1), (1, 1)):
            along[:, i, :, j] = self.block.along(self.tangents[:, i], self.tangents[:, j])
        along[:, 1, :, 0] = along[:, 0, :, 1].T
        return along.reshape(2 * k, 2 * k)

    @functools.cached_property
    def across(self) -> np.ndarray:
        """(2, k + c, k) m/N, of the gaps under forces along the two tangents."""
        block, size = self.block, 3 * self.block.k
        across = np.empty((2, block.k + block.c, block.k))
        for j in (0, 1):
            across[j, : block.k] = block.along(self.normal_then, self.tangents[:, j])
            core = block.matrix[size:, :size].reshape(block.c, block.k, 3)
            across[j, block.k :] = np.einsum("cai,ai->ca", core, self.tangents[:, j])
        return across


@dataclasses.dataclass(frozen=True)
class Basis:
    """Normals (k, 3) and tangents (k, 2, 3) of now, and compliances along those of now or of a little before."""

    normal: np.ndarray
    tangents: np.ndarray
    responses: Responses

    @staticmethod
    def at(block: NearBlock, normal: np.ndarray, older: Basis | None) -> Basis:
        """The basis at new normals, with the compliances of an older one while the normals have hardly turned."""
        lead = np.eye(3)[np.argmin(np.abs(normal), axis=1)] if older is None else older.tangents[:, 0]
        first = lead - np.einsum("ai,ai->a", lead, normal)[:, None] * normal
        first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
        tangents = np.stack([first, np.cross(normal, first)], axis=1)
        if older is not None and np.abs(normal - older.responses.normal_then).max() < _STALE:
            return Basis(normal, tangents, older.responses)
        return Basis(normal, tangents, Responses(block, normal, tangents))

    def lean(self, tangential: np.ndarray, friction: float) -> np.ndarray:
        """Components (k, 2) along the tangents of ``friction`` times the direction of (k, 3); 0 for no vector."""
        parts = np.einsum("aji,ai->aj", self.tangents, tangential)
        size = np.hypot(*parts.T)
        return friction * parts / np.where(size > 0, size, 1)[:, None]

    def in_space(self, parts: np.ndarray) -> np.ndarray:
        """Vectors (k, 3) from their components (k, 2) along the tangents."""
        return np.einsum("aji,aj->ai", self.tangents, parts)

    def leaning(self, lean: np.ndarray) -> np.ndarray:
        """Compliance (k + c, k + c) m/N of the gaps under forces that lean by (k, 2) off their normals."""
        matrix = self.responses.normal
        if lean.any():
            across, k = self.responses.across, len(lean)
            matrix = matrix.copy()
            matrix[:, :k] += across[0] * lean[:, 0] + across[1] * lean[:, 1]
        return matrix

    def in_plane(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (k, 3) without their normal part."""
        return vectors - np.einsum("ai,ai->a", vectors, self.normal)[:, None] * self.normal

    def hold(
        self, away: np.ndarray, limit: np.ndarray, tangential: np.ndarray, slips: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Tangential forces (k, 3) N within discs of radii ``limit`` (k,) N, and the nodes (k,) bool that slip.

        away : (k, 3) m, how far nodes stand from their spots under ``tangential``, the first guess, as is ``slips``
        """
        at = np.flatnonzero(limit > 0)
        parts = np.einsum("kaji,kai->kaj", self.tangents[None, at], np.stack([away[at], tangential[at]]))
        both = (2 * at[:, None] + [0, 1]).ravel()
        compliance = self.responses.along.take(both, 0).take(both, 1)
        free = parts[0] - (compliance @ parts[1].ravel()).reshape(-1, 2)
        force, slipping = hold(compliance, free, limit[at], parts[1], slips[at])
        answer, slips = np.zeros_like(tangential), np.zeros_like(slips)
        answer[at], slips[at] = np.einsum("aji,aj->ai", self.tangents[at], force), slipping
        return answer, slips
