"""One door to contact mechanics: a sensor, an indenter at a place, a depth or a force, and a tier."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np

from ..errors import TactileError
from ..indenters import Indenter, Pose
from .compliance import compliance_of
from .corrected_press import CorrectedPress
from .expected_error import expected_error
from .finite_strain import FiniteStrainSolid, State
from .finite_strain_tier import FRICTION_STEP, ONE_STEP, Body, Sensor, graded_body
from .newton import FiniteStrainContact, Touch
from .placement import FRICTION, Placement, on_gel, pose_at
from .thickness import DEPTH_LIMIT, thickness_under

Tier = Literal["fast", "full", "reference"]
TIERS: tuple[Tier, ...] = ("fast", "full", "reference")

_FORCE_TOLERANCE = 1e-4  # relative, of the search for a force
_SEARCH_STEPS = 20


@dataclasses.dataclass(frozen=True)
class Step:
    """A place on a path: ``depth`` m or ``force`` N along the motion, and how far the indenter has slid, m.

    slide : along the finger and across, in the indenter's own axes, from where it first touched
    """

    depth: float | None = None
    force: float | None = None
    slide: tuple[float, float] = (0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Solution:
    """A solved contact, SI units, whatever the tier.

    tier : which solver made it; converged : whether it may be used; iterations : of its last step
    displacement : (n, 3) m of the sensor's surface nodes; contact_patch : (n,) bool, nodes that carry force
    force : (3,) N, exerted by the indenter on the sensor; depth : m from first touch
    pressure : Pa, rise of the BioTac's fluid pressure, 0 for the DIGIT
    shape_error, force_error : 95 of 100 such contacts have less, see ``expected_error``: rms m over nodes that move
        more than 10 um, and relative
    penetration : m, deepest place of a node in the indenter or the core; slipping : share of the touching nodes
    core_nodes : inner-skin nodes that press on the core; load_steps : how many it took to get here from the last
    volume : the solid and its state, of the full and the reference tier
    """

    tier: Tier
    converged: bool
    iterations: int
    displacement: np.ndarray
    contact_patch: np.ndarray
    force: np.ndarray
    depth: float
    pressure: float
    shape_error: float
    force_error: float
    penetration: float
    slipping: float
    core_nodes: int
    load_steps: int = 1
    volume: tuple[FiniteStrainSolid, State] | None = None


def solve(
    sensor: Sensor,
    indenter: Indenter,
    place: Placement,
    *,
    depth: float | None = None,
    force: float | None = None,
    tier: Tier = "fast",
    friction: float = FRICTION,
) -> Solution:
    """Press ``indenter`` into ``sensor`` at ``place`` to a depth, m, or a force along the motion, N.

    ``fast`` is linear with a learned correction (milliseconds), ``full`` finite strain on a mesh graded round the
    contact (about a second; with friction up to twenty), ``reference`` the same on cells half as large (minutes).
    Raises TactileError for an impossible request, or for one beyond what the tier finds.
    """
    return next(solve_path(sensor, indenter, place, [Step(depth, force)], tier, friction))


def solve_path(
    sensor: Sensor,
    indenter: Indenter,
    place: Placement,
    steps: Iterable[Step],
    tier: Tier = "fast",
    friction: float = FRICTION,
) -> Iterator[Solution]:
    """Solutions along a path, each going on from the one before; those already yielded are kept on an error.

    Raises what ``solve`` raises.
    """
    steps = list(steps)
    if tier not in TIERS:
        raise TactileError("solve, tier", repr(tier), "fast, full or reference")
    if not (np.isfinite(friction) and friction >= 0):
        raise TactileError("solve, friction", repr(friction), "a coefficient of zero or more")
    if not on_gel(place.x, place.z):
        found = f"({place.x * 1e3:g}, {place.z * 1e3:g}) mm"
        raise TactileError("solve, place", found, "a place on the DIGIT's gel (x, z), see digit_shape.outline_distance")
    pose = pose_at(sensor, indenter, place)
    thick = thickness_under(sensor, indenter, pose)
    for step in steps:
        _check(step, DEPTH_LIMIT * thick)
    path = (_Fast if tier == "fast" else _FiniteStrain)(sensor, indenter, pose, thick, steps, tier, friction)
    for step in steps:
        yield path.to(step)


def _check(step: Step, limit: float) -> None:
    if (step.depth is None) == (step.force is None):
        raise TactileError("solve", f"depth {step.depth!r} and force {step.force!r}", "one of the two")
    name, value, unit = ("depth", step.depth, "m") if step.force is None else ("force", step.force, "N")
    if not (np.isfinite(value) and value >= 0):
        raise TactileError(f"solve, {name}", f"{value!r} {unit}", "zero or more, and finite")
    if step.depth is not None and step.depth > limit:
        expected = f"at most {limit * 1e3:.2f} mm, {DEPTH_LIMIT:.0%} of the thickness here"
        raise TactileError("solve, depth", f"{step.depth * 1e3:g} mm", expected, "Press less")
    if not (np.isfinite(step.slide).all() and np.abs(step.slide).max() <= _FARTHEST_SLIDE):
        found = f"{tuple(1e3 * s for s in step.slide)} mm"
        raise TactileError("solve, slide", found, f"two lengths of at most {_FARTHEST_SLIDE * 1e3:g} mm")


_FARTHEST_SLIDE = 10e-3  # m, half of the gel


class _Path:
    """A path of one indenter on one sensor; ``to`` goes on from the step before."""

    def __init__(
        self, sensor: Sensor, indenter: Indenter, pose: Pose, thick: float, steps: list[Step], tier: Tier,
        friction: float,
    ) -> None:  # fmt: skip
        self.sensor, self.indenter, self.pose, self.tier, self.friction = sensor, indenter, pose, tier, friction
        self.thickness, self.limit = thick, DEPTH_LIMIT * thick
        self.deepest = max((step.depth for step in steps if step.depth is not None), default=0.0)
        if any(step.force for step in steps):
            self.deepest = self.limit

    def errors(self, depth: float) -> tuple[float, float]:
        """Of a contact at a depth, m: see ``Solution``."""
        return expected_error(self.tier, self.sensor, depth / self.thickness)

    def unreachable(self, force: float) -> TactileError:
        """What is said where no depth within the limit gives a force."""
        expected = f"a force that is reached within {self.limit * 1e3:.2f} mm, {DEPTH_LIMIT:.0%} of the thickness here"
        return TactileError(f"solve, {self.sensor}, {self.tier} tier", f"force {force:g} N", expected, "Press less")


class _Fast(_Path):
    def __init__(self, *arguments) -> None:  # noqa: ANN002
        super().__init__(*arguments)
        self.press = CorrectedPress(compliance_of(self.sensor), self.indenter, self.pose, self.limit, self.friction)

    def to(self, step: Step) -> Solution:
        """See ``solve_path``. The force asked for is the corrected one."""
        pose, compliance = self.pose.slid(*step.slide), self.press.compliance
        if step.force:
            found = self.press.at_force(step.force, pose)
            if found is None:
                raise self.unreachable(step.force)
        else:
            found = self.press.at_depth(step.depth or 0.0, pose)
        contact, corrected = found.linear, found.corrected
        patch = np.zeros(len(compliance.surface.rest), bool)
        patch[compliance.touchable[contact.nodes]] = True
        return Solution(
            "fast", contact.converged, contact.iterations, corrected.displacement, patch, found.force, contact.depth,
            found.pressure, *self.errors(contact.depth), contact.penetration,
            float(contact.slipping.mean()) if len(contact.slipping) and self.friction else 0.0, len(contact.core_nodes),
        )  # fmt: skip


class _FiniteStrain(_Path):
    body: Body
    problem: FiniteStrainContact

    def __init__(self, *arguments) -> None:  # noqa: ANN002
        super().__init__(*arguments)
        self.body = graded_body(self.sensor, self.indenter, self.pose, self.deepest, self.tier)
        self.problem = self.body.contact(self.indenter, self.pose, self.deepest, self.friction)
        self.step = FRICTION_STEP if self.friction else ONE_STEP
        self.last = self.problem.start()

    def to(self, step: Step) -> Solution:
        """See ``solve_path``."""
        pose = self.pose.slid(*step.slide)
        if step.force:
            self.last = self._at_force(pose, step.force)
        elif step.depth or self.last.depth:
            self.last = self.problem.move(pose.moved(step.depth or 0.0), self.last, self.step)
        return self._solution(self.last)

    def _at_force(self, pose: Pose, force: float) -> Touch:
        """The contact at a force along the motion, by regula falsi on F^(2/3), nearly straight in the depth."""
        direction, goal = pose.direction, force ** (2 / 3)
        before, at = self.last, (self.last.depth, max(float(self.last.force @ self.pose.direction), 0.0) ** (2 / 3))
        depth = max(at[0], self.limit / 8)
        for _ in range(_SEARCH_STEPS):
            if depth > self.limit:
                raise self.unreachable(force)
            touch = self.problem.move(pose.moved(depth), before, self.step)
            found = max(float(touch.force @ direction), 0.0)
            if abs(found - force) <= _FORCE_TOLERANCE * force:
                return touch
            root = found ** (2 / 3)
            slope = max((root - at[1]) / (depth - at[0]) if depth != at[0] else 0.0, 1e-6)
            if root < goal:
                before, at = touch, (depth, root)
                depth += float(np.clip((goal - root) / slope, 0, self.limit / 4))
            else:
                depth = at[0] + float(np.clip((goal - at[1]) / slope, 0, depth - at[0]))
        raise self.unreachable(force)

    def _solution(self, touch: Touch) -> Solution:
        gap = touch.outer.gaps(self.body.solid.mesh.nodes + touch.state.displacement)
        slips = touch.outer.slipping[touch.outer.active]
        return Solution(
            self.tier, True, touch.iterations, self.body.displacement(touch), self.body.contact_patch(touch),
            touch.force, touch.depth, touch.fluid, *self.errors(touch.depth), float(-gap.min(initial=0.0)),
            float(slips.mean()) if len(slips) and self.friction else 0.0, len(touch.inner.nodes), touch.steps,
            (self.body.solid, touch.state),
        )  # fmt: skip
