"""A press in the fast tier whose forces and shapes are the corrected ones."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..indenters import Indenter, Pose
from .compliance import Compliance
from .contact import Contact, ContactProblem, fluid_pressure
from .correction import Corrected, correct, force_factor
from .first_touch import fall
from .pose_path import same_line
from .sunk import check_follows

FORCE_TOLERANCE = 1e-3  # relative, of the force asked for: a fiftieth of the error of the corrected force
_FIRST_DEPTH = 30e-6  # m, where a search for a force starts
_GROWTH = 1.6  # largest change of force in one step of a search, which a warm start follows safely
_LEAST_DEPTH = 1e-6  # m, of a contact that has slid: friction may hold it where the resting surface is not reached
_SEARCH_STEPS = 24
_POWER_FROM, _POWERS = 1e-2, (0.7, 1.5)  # least growth that tells the power; what it may be (assumed)


@dataclasses.dataclass(frozen=True)
class FastContact:
    """A contact of the linear model, and what its correction makes of it. Forces N, by the indenter on the sensor.

    linear : as solved; corrected : shape and factor; force : (3,); axial_force : along the motion
    pressure : Pa, rise of the fluid's; depth : m, from first touch where the indenter has slid to
    """

    linear: Contact
    corrected: Corrected
    force: np.ndarray
    axial_force: float
    pressure: float
    depth: float


class CorrectedPress:
    """An indenter in front of one sensor; contacts follow each other, at depths or at corrected forces.

    pose : at first touch; limit : m, the greatest depth; friction : Coulomb's coefficient
    """

    def __init__(
        self, compliance: Compliance, indenter: Indenter, pose: Pose, limit: float, friction: float = 0.0
    ) -> None:
        self.compliance, self.pose, self.limit = compliance, pose, limit
        self.problem = ContactProblem(compliance, indenter, pose, limit, friction)
        self.last: Contact | None = None
        self._last_power = 1.0

    def at_depth(self, depth: float, pose: Pose | None = None) -> FastContact:
        """The contact at a depth, m, of the press's pose or of another one; it may not have converged.

        Raises TactileError for an indenter that sinks in between the surface's nodes, as ``at_force`` does.
        """
        pose = pose or self.pose
        contact = self.problem.at_pose(pose.moved(depth), self.last)
        if contact.converged:
            self.last = contact
        return self._with_correction(contact, self._fall_to(pose))

    def at_force(self, force: float, pose: Pose | None = None) -> FastContact | None:
        """The contact whose corrected force along the motion is ``force`` N; None beyond the limit, or if not found.

        A secant in the logarithms of the linear and the corrected force: one follows the other nearly as a power.
        """
        pose = pose or self.pose
        contact, fall = self.last or self._first(pose), self._fall_to(pose)
        if contact is not None and not same_line(contact.pose, pose):
            contact = self.problem.at_pose(pose.moved(contact.depth), contact, contact.axial_force)
        before: tuple[float, float] | None = None  # linear and corrected force, N
        for _ in range(_SEARCH_STEPS):
            if contact is None or not contact.converged:
                return None
            linear, seen = contact.axial_force, _from_touch(contact, fall)
            found = linear, linear * force_factor(self.compliance, seen)
            close = found[1] > 0 and abs(found[1] / force - 1) < FORCE_TOLERANCE
            if seen.depth > self.limit and (close or found[1] < force):
                return None
            if close:
                self.last = contact
                return self._with_correction(contact, fall)
            growth = (force / max(found[1], 1e-12)) ** (1 / self._power(before, found))
            before, goal = found, linear * float(np.clip(growth, 1 / _GROWTH, _GROWTH))
            contact = self.problem.at_pose(pose.moved(contact.depth), contact, goal)
        return None

    def _power(self, before: tuple[float, float] | None, found: tuple[float, float]) -> float:
        """By which power the corrected force grows with the linear one, between two contacts; kept for the next."""
        if before is not None and min(*before, *found) > 0:
            linear, corrected = np.log(found) - np.log(before)
            if abs(linear) > _POWER_FROM:
                self._last_power = float(np.clip(corrected / linear, *_POWERS))
        return self._last_power

    def _first(self, pose: Pose) -> Contact | None:
        """The first contact that carries force; a coarse lattice may be missed by the shallowest depths."""
        depth = _FIRST_DEPTH
        while depth <= self.limit:
            contact = self.problem.at_pose(pose.moved(depth))
            if contact.converged and contact.axial_force > 0:
                return contact
            depth *= 1.5
        return None

    def _fall_to(self, pose: Pose) -> float:
        return fall(self.compliance.surface, self.problem.indenter, self.pose, pose)

    def _with_correction(self, contact: Contact, fall: float) -> FastContact:
        made = correct(self.compliance, _from_touch(contact, fall))
        if contact.converged:
            self._check_follows(contact)
        pressure = made.factor * fluid_pressure(self.compliance, contact)
        force, axial = made.factor * contact.force, made.factor * contact.axial_force
        return FastContact(contact, made, force, axial, pressure, contact.depth - fall)

    def _check_follows(self, contact: Contact) -> None:
        surface = self.compliance.surface
        rows, columns = surface.shape
        grid = surface.grid(surface.rest + contact.displacement)
        where, closed = f"fast tier, {self.compliance.name}", len(surface.rest) > rows * columns
        indenter, pose = self.problem.indenter, contact.pose
        nodes = self.compliance.touchable[contact.nodes]
        _, normals = pose.distance(indenter, surface.rest[nodes] + contact.displacement[nodes])
        check_follows(where, grid, indenter, pose, contact.depth, normals, closed=closed)


def _from_touch(contact: Contact, fall: float) -> Contact:
    """A contact with its depth measured from first touch where the indenter has slid to, as the correction knows it."""
    depth = max(contact.depth - fall, _LEAST_DEPTH)
    return contact if depth == contact.depth else dataclasses.replace(contact, depth=depth)
