"""Fast presses straight in from first touch, in one step: contacts that depend on pose, or place and force, alone."""

from __future__ import annotations

from typing import NamedTuple

from .. import sensors
from ..errors import TactileError
from ..geometry.indenters import Indenter, Pose
from .fast.compliance import compliance_of
from .fast.press import CorrectedPress, FastContact
from .first_touch import first_touch_on_line
from .force_search import MOST_FORCE, UnreachableError, touch_at_force, unreachable
from .thickness import DEPTH_LIMIT, thickness_under

_LEAST_FORCE = 1e-5  # N, the weight of 1 mg: less is lost in rounding


class StraightPress(NamedTuple):
    """A contact and the press that found it, whose ``pose`` is at first touch."""

    press: CorrectedPress
    found: FastContact


def straight_press(
    sensor: str, indenter: Indenter, pose: Pose, force: float | None, friction: float
) -> StraightPress | None:
    """Press an indenter in along its direction to a pose, or with a force along it, N, on its line; None: no contact.

    Raises TactileError for a force that is none, one on a line that passes the sensor by, and where no contact is
    found; UnreachableError beyond 60 % of the thickness.
    """
    where = f"press, {sensor}"
    if force is not None and not 0 <= force <= MOST_FORCE:  # nan too
        raise TactileError(f"{where}, force", f"{force:g} N", f"0 to {MOST_FORCE:g} N")
    if force is not None and force < _LEAST_FORCE:
        return None
    try:
        touch = first_touch_on_line(sensors.sensor_surface(sensor), indenter, pose)
    except TactileError:
        if force is not None:
            raise
        return None
    limit = DEPTH_LIMIT * thickness_under(sensor, indenter, touch)
    press = CorrectedPress(compliance_of(sensor), indenter, touch, limit, friction)

    def at_depth(depth: float, _: FastContact | None = None) -> FastContact:
        """Press from nothing to a depth, m, past first touch."""
        press.last = None
        found = press.at_depth(depth, touch, touches=True)
        if not found.linear.converged:
            raise TactileError(where, f"no contact found at {depth * 1e3:g} mm", "one that settles", "Press elsewhere")
        return found

    if force is not None:
        near = press.at_force(force, touch, touches=True)  # by small steps, on which friction depends
        if near is None:
            raise unreachable(where, force, limit)
        found = touch_at_force(at_depth, at_depth(0.0), pose.direction, force, limit, where, guess=near.depth)
        return StraightPress(press, found)
    depth = float((pose.apex - touch.apex) @ pose.direction)
    if depth <= 0:
        return None
    if depth > limit:
        expected = f"at most {limit * 1e3:.2f} mm, {DEPTH_LIMIT:.0%} of the thickness here"
        raise UnreachableError(f"{where}, depth", f"{depth * 1e3:g} mm", expected, "Press less")
    return StraightPress(press, at_depth(depth))
