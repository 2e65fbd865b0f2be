"""A press as a path of growing force on both sensors: the same force, angle and unrolled place."""

from __future__ import annotations

import dataclasses

import numpy as np

from .. import digit_shape, sensors, surface
from ..indenters import Indenter, Pose, pose_on
from .compliance import Compliance
from .contact import Contact, ContactProblem
from .first_touch import first_touch
from .thickness import DEPTH_LIMIT, thickness

FRICTION = 0.78  # Coulomb's coefficient of the BioTac's skin (sensors.md), taken for both sensors
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
    pose = pose_on(indenter, point, outward, place.tilt, place.tilt_heading)
    return first_touch(sensors.biotac_surface(), indenter, pose)


def digit_pose(indenter: Indenter, place: Placement) -> Pose:
    """First touch on the DIGIT's gel at (x, z), leaning as much off the dome's normal as off the BioTac's."""
    point, outward = digit_shape.dome_point(place.x, place.z)
    pose = pose_on(indenter, point, outward, place.tilt, place.tilt_heading)
    return first_touch(sensors.digit_surface(), indenter, pose)


def depth_limit(compliance: Compliance, indenter: Indenter, pose: Pose) -> float:
    """How deep, m, an indenter may go in from first touch: 60 % of the sensor's thickness where it first touches."""
    return DEPTH_LIMIT * thickness(compliance.name, touched_point(compliance, indenter, pose))


def touched_point(compliance: Compliance, indenter: Indenter, pose: Pose) -> np.ndarray:
    """The node (3,) m of the resting surface nearest to an indenter at first touch."""
    rest = compliance.surface.rest
    return rest[int(np.argmin(pose.distance(indenter, rest)[0]))]


def on_gel(x: float, z: float, margin: float = 0.0) -> bool:
    """Whether a place of the DIGIT's plane lies on the gel, at least ``margin`` m inside its outline."""
    return bool(digit_shape.outline_distance(np.array(x), np.array(z)) > margin)


class Press:
    """An indenter pressed into one sensor at one place; contacts follow each other with growing or falling force.

    pose : at first touch; max_depth : m, 60 % of the thickness there where none is given
    friction : Coulomb's coefficient, 0 for none; the contacts then depend on the order in which they are asked for
    """

    def __init__(
        self, compliance: Compliance, indenter: Indenter, pose: Pose, max_depth: float | None = None,
        friction: float = 0.0,
    ) -> None:  # fmt: skip
        self.compliance = compliance
        self.max_depth = depth_limit(compliance, indenter, pose) if max_depth is None else max_depth
        self.problem = ContactProblem(compliance, indenter, pose, self.max_depth, friction)
        self.last: Contact | None = None

    def at_force(self, force: float) -> Contact | None:
        """The contact at an axial force, N, or None where it lies too deep or was not found."""
        contact = self.last or self._first_touch()
        while contact is not None and abs(contact.axial_force - force) > 1e-6 * force:
            step = np.clip(force / contact.axial_force, 1 / _FORCE_RATIO, _FORCE_RATIO)
            contact = self.problem.at_force(contact.axial_force * step, contact)
            if not contact.converged or not 0 < contact.depth <= self.max_depth:
                return None
        if contact is not None:
            self.last = contact
        return contact

    def at_depth(self, depth: float) -> Contact | None:
        """The contact at a depth, m, or None where it lies too deep or was not found."""
        if depth > self.max_depth:
            return None
        contact = self.problem.at_depth(depth, self.last if self.problem.friction else None)
        if not contact.converged:
            return None
        self.last = contact if contact.axial_force > 0 else None
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
