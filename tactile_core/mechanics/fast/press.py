"""Press an indenter into a sensor in the fast tier, with corrected forces and shapes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from ...errors import TactileError
from ...files.threads import in_one_thread
from ...geometry.indenters import Indenter, Pose
from ..force_search import FORCE_TOLERANCE, touch_at_force
from ..penetration import BENDS, PenetrationError, sharpest
from ..placement import same_line, surface_drop
from .active_set import ExhaustedError, UnsolvedError, Work
from .compliance import Compliance
from .contact import ContactProblem
from .contact_state import Contact
from .correction import Corrected, correct, force_factor
from .edge_contact import EdgeContactProblem

_FIRST_DEPTH = 30e-6  # m, where a search for a force starts
_GROWTH = 1.6  # largest factor of force in one step of a search, safe for a warm start
_LEAST_DEPTH = 1e-6  # m, of a contact that has slid: friction may hold the surface where at rest it is not reached
_SEARCH_STEPS = 24
_POWER_FROM, _POWERS = 1e-2, (0.7, 1.5)  # least growth that determines the power; its range (assumed)


@dataclasses.dataclass(frozen=True)
class FastContact:
    """A contact of the linear model with its correction. Forces N, by the indenter on the sensor.
    linear : contact before the correction; corrected : corrected shape, and factor of force
    force : (3,), corrected; axial_force : its part along the motion; pressure : Pa, corrected rise of the fluid's
    depth : m, from first touch at the place to which the indenter has slid"""

    linear: Contact
    corrected: Corrected
    force: np.ndarray
    axial_force: float
    pressure: float
    depth: float


_Found = TypeVar("_Found", FastContact, FastContact | None)


class CorrectedPress:
    """An indenter in front of one sensor; solves contacts at depths or at corrected forces, each from the one before.

    pose : at first touch; limit : m, the greatest depth; friction : Coulomb's coefficient
    work : budget of computing, None for no limit; once it is used up, ``at_depth`` raises ExhaustedError
        and ``at_force`` returns None"""

    @in_one_thread
    def __init__(
        self, compliance: Compliance, indenter: Indenter, pose: Pose, limit: float, friction: float = 0.0,
        work: Work | None = None,
    ) -> None:  # fmt: skip
        self.compliance, self.pose, self.limit = compliance, pose, limit
        self.problem = ContactProblem(compliance, indenter, pose, limit, friction, work)
        self.last: Contact | None = None
        self._on_the_way: tuple[Contact, float] | None = None  # last contact of a search, and ``drop`` there
        self._last_power = 1.0

    @in_one_thread
    def at_depth(self, depth: float, pose: Pose | None = None, *, touches: bool = False) -> FastContact:
        """Solve the contact at a depth, m, past first touch, along the motion of ``pose`` (None: the press's own). See
        ``linear.converged`` of the result.
        touches : true if ``pose`` is known to be at first touch; if false, first touch is found from it
        Raises PenetrationError for an indenter that sinks in between the surface's nodes, as ``at_force`` does."""
        there = pose or self.pose
        drop = self._surface_drop(there, touches=touches)
        return self._guarded_if_needed(lambda: self._at_depth(depth, there, drop))

    @in_one_thread
    def at_force(self, force: float, pose: Pose | None = None, *, touches: bool = False) -> FastContact | None:
        """Solve the contact whose corrected force along the motion is force N, to a thousandth; None if that lies
        beyond the limit, or is not found. pose : None for the press's own; touches : as in ``at_depth``"""
        there = pose or self.pose
        drop, self._on_the_way = self._surface_drop(there, touches=touches), None
        try:
            return self._guarded_if_needed(lambda: self._at_force(force, there, drop))
        except UnsolvedError:
            return None

    @in_one_thread
    def nearest(self) -> FastContact | None:
        """Return the last contact within the limit that ``at_force``'s search met; the next solve starts from it.

        None if there is none. Raises PenetrationError if the indenter sinks in between the surface's nodes.
        """
        if self._on_the_way is None:
            return None
        self.last, drop = self._on_the_way
        return self._with_correction(self.last, drop)

    def _guarded_if_needed(self, solve: Callable[[], _Found]) -> _Found:
        """Call ``solve``; if the indenter sinks in between frictionless nodes, call it again with points between them.

        The second time it starts from rest, and the points stay for all contacts that follow.
        """
        try:
            found = solve()
            if found is None or found.linear.converged or not self._may_be_guarded():
                return found
        except ExhaustedError:
            raise
        except (PenetrationError, UnsolvedError):
            if not self._may_be_guarded():
                raise
        before = self.problem
        self.problem = EdgeContactProblem(self.compliance, before.indenter, self.pose, self.limit, before.work)
        self.last = None
        return solve()

    def _may_be_guarded(self) -> bool:
        """Return true if nodes may slide off the indenter, and the surface between them can bend round it."""
        if self.problem.friction or isinstance(self.problem, EdgeContactProblem):
            return False
        rest = self.compliance.surface.rest[self.compliance.touchable[self.problem.nodes_near]]
        return sharpest(self.problem.indenter, self.pose, rest) >= BENDS

    def _at_depth(self, depth: float, pose: Pose, drop: float) -> FastContact:
        contact = self.problem.at_pose(pose.moved(depth), self.last)
        if contact.converged:
            self.last = contact
        return self._with_correction(contact, drop)

    def _at_force(self, force: float, pose: Pose, drop: float) -> FastContact | None:
        """Find the contact at a corrected force N by secants in the logs of linear and corrected force, nearly a line.

        drop : m, how much deeper first touch is than at the press's own pose
        None beyond the limit; raises UnsolvedError if none is found."""
        if isinstance(self.problem, EdgeContactProblem):
            return self._by_depths(force, pose, drop)
        contact = self.last or self._find_first_contact(pose)
        if contact is not None and not same_line(contact.pose, pose):
            contact = self.problem.at_pose(pose.moved(contact.depth), contact, contact.axial_force)
        before: tuple[float, float] | None = None  # linear and corrected force, N
        for _ in range(_SEARCH_STEPS):
            if contact is None or not contact.converged:
                raise UnsolvedError(f"no contact at {force:g} N")
            linear, seen = contact.axial_force, _from_touch(contact, drop)
            found = linear, linear * force_factor(self.compliance, seen)
            close = found[1] > 0 and abs(found[1] / force - 1) < FORCE_TOLERANCE
            if seen.depth > self.limit and (close or found[1] < force):
                if not self.problem.friction:  # an indenter that has penetrated bears less force
                    self.problem.check_follows(contact)
                return None
            if close:
                self.last = contact
                return self._with_correction(contact, drop)
            if seen.depth <= self.limit:
                self._on_the_way = contact, drop
            growth = (force / max(found[1], 1e-12)) ** (1 / self._power(before, found))
            before, goal = found, linear * float(np.clip(growth, 1 / _GROWTH, _GROWTH))
            contact = self.problem.at_pose(pose.moved(contact.depth), contact, goal)
        raise UnsolvedError(f"{force:g} N not found in {_SEARCH_STEPS} steps")

    def _by_depths(self, force: float, pose: Pose, drop: float) -> FastContact | None:
        """Find the contact at a force N by a search over depth, faster with points between nodes; drop, result and
        errors are ``_at_force``'s."""

        def move(depth: float, before: FastContact) -> FastContact:
            """Return the corrected contact at a depth m from first touch, starting from the contact before."""
            contact = self.problem.at_pose(pose.moved(depth + drop), before.linear)
            if not contact.converged:
                raise UnsolvedError(f"no contact at {depth * 1e3:g} mm")
            return self._with_correction(contact, drop)

        start = self.last or self.problem.at_pose(pose.moved(drop))
        begin = self._with_correction(start, drop)
        try:
            found = touch_at_force(move, begin, pose.direction, force, self.limit, "")
        except PenetrationError:
            raise
        except TactileError:  # beyond the limit
            return None
        self.last = found.linear
        return found

    def _power(self, before: tuple[float, float] | None, found: tuple[float, float]) -> float:
        """Return the power by which the corrected force grows with the linear one from contact ``before`` to ``found``,
        each (linear, corrected) N; the last power if they hardly differ."""
        if before is not None and min(*before, *found) > 0:
            linear, corrected = np.log(found) - np.log(before)
            if abs(linear) > _POWER_FROM:
                self._last_power = float(np.clip(corrected / linear, *_POWERS))
        return self._last_power

    def _find_first_contact(self, pose: Pose) -> Contact | None:
        """Find a shallow contact that carries force (the shallowest may touch no node); None if none is found."""
        depth = _FIRST_DEPTH
        while depth <= self.limit:
            contact = self.problem.at_pose(pose.moved(depth))
            if contact.converged and contact.axial_force > 0:
                return contact
            depth *= 1.5
        return None

    def _surface_drop(self, pose: Pose, *, touches: bool) -> float:
        """Return how much deeper, m, first touch is at a pose than at the press's own; touches : true if it is there"""
        if touches:
            return float((pose.apex - self.pose.apex) @ pose.direction)
        return surface_drop(self.compliance.surface, self.problem.indenter, self.pose, pose)

    def _with_correction(self, contact: Contact, drop: float) -> FastContact:
        if contact.converged:
            self.problem.check_follows(contact)
        made = correct(self.compliance, _from_touch(contact, drop))
        pressure = made.factor * contact.fluid_pressure
        force, axial = made.factor * contact.force, made.factor * contact.axial_force
        return FastContact(contact, made, force, axial, pressure, contact.depth - drop)


def _from_touch(contact: Contact, drop: float) -> Contact:
    """Return a contact with its depth counted from first touch at the place slid to, ``drop`` m deeper than at the
    press's own, as the correction expects."""
    depth = max(contact.depth - drop, _LEAST_DEPTH)
    return contact if depth == contact.depth else contact.at_depth(depth)
