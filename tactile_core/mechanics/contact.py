"""Frictionless contact of a rigid indenter with a sensor's surface: primal-dual active set on the compliance.

Unknown are the normal forces of the touching nodes and, when a force is asked for, the depth. Each iteration
linearises the indenter's signed distance at the deformed position and solves a small dense system.
Hintermueller, Ito, Kunisch, SIAM J. Optim. 13, 2003: the active set as a semismooth Newton method.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..indenters import Indenter, Pose
from .compliance import Compliance

GAP_TOLERANCE = 0.05e-6  # m: 1/20 of the 1 um penetration that MECHANICS allows
NORMAL_TOLERANCE = 1e-3  # rad, between the normal a force was computed with and the one where it ends up
MAX_ITERATIONS = 40
_REACH = 1.5e-3  # m, nodes this far outside the indenter at the start of a solve may come to touch it


@dataclasses.dataclass(frozen=True)
class Contact:
    """One solved contact. Lengths m, forces N, exerted by the indenter on the sensor.

    depth : how far the indenter moved in from first touch; force : (3,); axial_force : its part along the motion
    nodes : (k,) touchable indices that carry force; nodal_force : (k, 3)
    converged : whether active set and gaps settled; iterations : how many it took
    """

    depth: float
    force: np.ndarray
    axial_force: float
    nodes: np.ndarray
    nodal_force: np.ndarray
    converged: bool
    iterations: int


class ContactProblem:
    """An indenter at a pose in front of one sensor; solves for a depth or for a force along the direction of motion.

    Nodes are followed only where the indenter can reach them, ``reach`` m in from the pose at depth 0.
    """

    def __init__(self, compliance: Compliance, indenter: Indenter, pose: Pose, reach: float) -> None:
        self.compliance, self.indenter, self.pose = compliance, indenter, pose
        rest = compliance.surface.rest[compliance.touchable]
        near, _ = pose.moved(reach).distance(indenter, rest)
        self.near = np.flatnonzero(near < _REACH)
        self.rest = rest[self.near]
        rows = (3 * self.near[:, None] + np.arange(3)).ravel()
        columns = (3 * compliance.touchable[self.near][:, None] + np.arange(3)).ravel()
        block = np.asarray(compliance.move[rows][:, columns], np.float64)
        k = len(self.near)
        self.block = block.reshape(k, 3, k, 3)

    def at_depth(self, depth: float, start: Contact | None = None) -> Contact:
        """The contact at a given depth, m."""
        return self._solve(depth, None, start)

    def at_force(self, axial_force: float, start: Contact) -> Contact:
        """The contact whose force along the motion is ``axial_force`` N, starting from a solved one."""
        return self._solve(start.depth, axial_force, start)

    def _solve(self, depth: float, axial_force: float | None, start: Contact | None) -> Contact:
        direction = self.pose.direction
        displacement, force = self._begin(start)
        active = force.any(axis=1)
        seen: set[bytes] = set()
        for iteration in range(1, MAX_ITERATIONS + 1):
            distance, normal = self.pose.moved(depth).distance(self.indenter, self.rest + displacement)
            if not active.any():
                force, displacement = np.zeros_like(force), np.zeros_like(displacement)
                distance, normal = self.pose.moved(depth).distance(self.indenter, self.rest)
                active = distance < 0
                if not active.any():
                    return self._result(depth, force, converged=axial_force is None, iterations=iteration)
            index = np.flatnonzero(active)
            pressing, step = self._newton(index, distance, normal, displacement, direction, axial_force)
            depth += step
            force = np.zeros_like(displacement)
            force[index] = pressing[:, None] * normal[index]
            displacement = np.einsum("ai,aibj->bj", force[index], self.block[index], optimize=True)
            distance, turned = self.pose.moved(depth).distance(self.indenter, self.rest + displacement)
            release = np.zeros_like(active)
            release[index] = pressing < 0
            enter = ~active & (distance < -GAP_TOLERANCE)
            still = max(np.abs(distance[index]).max(), abs(step)) < GAP_TOLERANCE
            still &= np.abs(turned[index] - normal[index]).max() < NORMAL_TOLERANCE
            if still and not release.any() and not enter.any():
                return self._result(depth, force, converged=True, iterations=iteration)
            active = self._next(active, release, enter, distance, pressing, index, seen)
        return self._result(depth, force, converged=False, iterations=MAX_ITERATIONS)

    def _next(self, active, release, enter, distance, pressing, index, seen) -> np.ndarray:  # noqa: ANN001
        """The next active set; once a set comes back, one node is changed at a time, which breaks the cycle."""
        proposal = (active & ~release) | enter
        key = proposal.tobytes()
        if key not in seen or not (release.any() or enter.any()):
            seen.add(key)
            return proposal
        single = active.copy()
        if release.any():
            single[index[np.argmin(pressing)]] = False
        else:
            single[np.argmin(np.where(enter, distance, 0))] = True
        return single

    def _begin(self, start: Contact | None) -> tuple[np.ndarray, np.ndarray]:
        force = np.zeros((len(self.near), 3))
        if start is None or not len(start.nodes):
            return np.zeros_like(force), force
        where = np.searchsorted(self.near, start.nodes)
        force[where] = start.nodal_force
        return np.einsum("ai,aibj->bj", force[where], self.block[where], optimize=True), force

    def _newton(self, index, distance, normal, displacement, direction, axial_force):  # noqa: ANN001, ANN202
        """Normal forces (k,) N that close the linearised gaps, and the step in depth, m."""
        n = normal[index]
        block = self.block[np.ix_(index, range(3), index, range(3))]
        matrix = np.einsum("ai,aibj,bj->ab", n, block, n, optimize=True)
        gap = np.einsum("ai,ai->a", n, displacement[index]) - distance[index]
        if axial_force is None:
            return np.linalg.solve(matrix, gap), 0.0
        along = n @ direction
        k = len(index)
        bordered = np.zeros((k + 1, k + 1))
        bordered[:k, :k], bordered[:k, k], bordered[k, :k] = matrix, -along, along
        answer = np.linalg.solve(bordered, np.r_[gap, axial_force])
        return answer[:k], float(answer[k])

    def _result(self, depth: float, force: np.ndarray, *, converged: bool, iterations: int) -> Contact:
        carrying = np.flatnonzero(force.any(axis=1))
        total = force.sum(axis=0)
        return Contact(
            depth,
            total,
            float(total @ self.pose.direction),
            self.near[carrying],
            force[carrying],
            converged,
            iterations,
        )


def surface_displacement(compliance: Compliance, contact: Contact) -> np.ndarray:
    """Displacement (n, 3) m of the whole surface in a contact."""
    return _answer(compliance.move, contact).reshape(-1, 3)


def watched_gaps(compliance: Compliance, contact: Contact) -> np.ndarray:
    """Gaps (w,) m of the watched points in a contact: 19 electrodes, then inner skin over the core."""
    return compliance.watch_gap + _answer(compliance.watch, contact)


def fluid_pressure(compliance: Compliance, contact: Contact) -> float:
    """Rise of the fluid's pressure in a contact, Pa."""
    return float(_answer(compliance.pressure[:, None], contact)[0])


def _answer(matrix: np.ndarray, contact: Contact) -> np.ndarray:
    rows = (3 * contact.nodes[:, None] + np.arange(3)).ravel()
    return contact.nodal_force.ravel() @ np.asarray(matrix[rows], np.float64)
