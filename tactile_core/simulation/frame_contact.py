"""Solve a frame of a scene on one sensor: a force at a place, in any tier; and extract what a recording stores
of it.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ..errors import TactileError
from ..geometry.indenters import Indenter
from ..mechanics.electrodes.law import signal_of
from ..mechanics.fast.compliance import compliance_of
from ..mechanics.fast.press import CorrectedPress, FastContact
from ..mechanics.finite_strain.press import FullPress
from ..mechanics.placement import Placement, pose_at
from ..mechanics.thickness import DEPTH_LIMIT, thickness_under
from .pair_sampling import contact_center

_SPARE = 1.1  # of the depth that the fast tier finds, in which the finite-strain tiers search


@dataclasses.dataclass(frozen=True)
class FrameContact:
    """A contact, m, N, Pa, by the indenter on the sensor; what costs time is computed where it is asked for.

    force : (3,); pressure : rise of the fluid's; depth : from first touch; thickness : of the sensor there
    """

    sensor: str
    force: np.ndarray
    pressure: float
    depth: float
    thickness: float
    _solved: object = dataclasses.field(repr=False)

    @property
    def displacement(self) -> np.ndarray:
        """Displacement (n, 3) m of the sensor's surface nodes."""
        solved = self._solved
        return solved.corrected.displacement if isinstance(solved, FastContact) else solved.displacement

    def signal(self, law: str) -> np.ndarray:
        """Change (19,) counts of the BioTac's electrodes, by a law of ``law.LAWS``."""
        solved = self._solved
        return signal_of(solved.linear if isinstance(solved, FastContact) else solved, law)

    @functools.cached_property
    def centre(self) -> np.ndarray:
        """Centre of pressure (2,) = (x, z) m on the DIGIT's resting gel."""
        solved = self._solved
        return contact_center(solved.linear) if isinstance(solved, FastContact) else solved.centre


def frame_contact(
    sensor: str, indenter: Indenter, place: Placement, force: float, tier: str = "fast"
) -> FrameContact | None:
    """The contact without friction at a force along the motion, N; None where 60 % of the thickness do not bear it.

    Raises TactileError where a finite-strain tier finds none.
    """
    pose = pose_at(sensor, indenter, place)
    thickness = thickness_under(sensor, indenter, pose)
    limit = DEPTH_LIMIT * thickness
    found = CorrectedPress(compliance_of(sensor), indenter, pose, limit).at_force(force)
    if found is None:
        return None
    depth = found.linear.depth
    if tier != "fast":
        found = FullPress(sensor, indenter, pose, min(_SPARE * depth, limit), 0.0, tier).at_force(force, depth)
        depth = found.depth
        if depth > limit:
            raise TactileError(f"{tier} tier, {sensor}", f"{force:g} N", f"a force within {limit * 1e3:.2f} mm")
    return FrameContact(sensor, found.force, found.pressure, depth, thickness, found)
