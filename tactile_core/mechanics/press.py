"""A press as a path of growing force on both sensors: the same force, angle and unrolled place."""

from __future__ import annotations

import dataclasses

import numpy as np

from .. import digit_shape, surface
from ..indenters import Indenter, Pose, pose_on
from .compliance import Compliance
from .contact import Contact, ContactProblem, watched_gaps

# The linear model is right for small depths. At 25 % of the gel its shape is still below the error of a mesh, its force
# some 20 % low (mechanics.md: -18 % at 1.0, -31 % at 1.5 mm).
MAX_DEPTH = 1.2e-3  # m, on either sensor
CORE_MARGIN = 20e-6  # m, a path ends before the inner skin comes this close to the core: core contact is not modelled
FIRST_DEPTH = 30e-6  # m, from which a path starts
_FORCE_RATIO = 1.6  # largest growth of force in one step that the warm start follows safely


@dataclasses.dataclass(frozen=True)
class Placement:
    """A place and an angle: (x, z) m on the DIGIT's plane, and the lean of the indenter's axis, rad."""

    x: float
    z: float
    tilt: float = 0.0
    tilt_heading: float = 0.0


def biotac_pose(indenter: Indenter, place: Placement) -> Pose:
    """First touch on the BioTac, at the place of its pad that rolls onto (x, z) of the DIGIT's plane."""
    point, outward = surface.roll_up(np.array([place.x, place.z]))
    return pose_on(indenter, point, outward, place.tilt, place.tilt_heading)


def digit_pose(indenter: Indenter, place: Placement) -> Pose:
    """First touch on the DIGIT's gel at (x, z), leaning as much off the dome's normal as off the BioTac's."""
    point, outward = digit_shape.dome_point(place.x, place.z)
    return pose_on(indenter, point, outward, place.tilt, place.tilt_heading)


def on_gel(x: float, z: float, margin: float = 0.0) -> bool:
    """Whether a place of the DIGIT's plane lies on the gel, at least ``margin`` m inside its outline."""
    return bool(digit_shape.outline_distance(np.array(x), np.array(z)) > margin)


class Press:
    """An indenter pressed into one sensor at one place; contacts follow each other with growing or falling force."""

    def __init__(self, compliance: Compliance, indenter: Indenter, pose: Pose, max_depth: float = MAX_DEPTH) -> None:
        self.compliance, self.max_depth = compliance, max_depth
        self.problem = ContactProblem(compliance, indenter, pose, max_depth)
        self.last: Contact | None = None

    def at_force(self, force: float) -> Contact | None:
        """The contact at an axial force, N, or None when it lies beyond what the linear model may be asked."""
        contact = self.last or self._first_touch()
        while contact is not None and abs(contact.axial_force - force) > 1e-9 * force:
            step = np.clip(force / contact.axial_force, 1 / _FORCE_RATIO, _FORCE_RATIO)
            contact = self.problem.at_force(contact.axial_force * step, contact)
            if not contact.converged or not 0 < contact.depth <= self.max_depth:
                return None
        if contact is None or self._touches_core(contact):
            return None
        self.last = contact
        return contact

    def at_depth(self, depth: float) -> Contact | None:
        """The contact at a depth, m, or None when it lies beyond what the linear model may be asked."""
        contact = self.problem.at_depth(depth)
        if depth > self.max_depth or not contact.converged or self._touches_core(contact):
            return None
        return contact

    def _first_touch(self) -> Contact | None:
        """The first contact that carries force; a coarse lattice may be missed by the shallowest depths."""
        depth = FIRST_DEPTH
        while depth <= self.max_depth:
            contact = self.problem.at_depth(depth)
            if contact.converged and contact.axial_force > 0:
                return contact
            depth *= 1.5
        return None

    def _touches_core(self, contact: Contact) -> bool:
        return len(self.compliance.watch_gap) > 0 and watched_gaps(self.compliance, contact).min() < CORE_MARGIN
