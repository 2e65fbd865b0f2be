"""Solve contact mechanics through one interface: a sensor, an indenter at a place, a depth or a force, and a tier."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np

from ..errors import TactileError
from ..geometry.indenters import Indenter, Pose
from . import error_estimate
from .error_estimate import expected_error
from .fast.compliance import compliance_of
from .fast.press import CorrectedPress
from .finite_strain.body import FRICTION_STEP, ONE_STEP, Body, Sensor, graded_body
from .finite_strain.contact_state import ContactState
from .finite_strain.newton import FiniteStrainContact, NoEquilibriumError
from .force_search import ROUGH, TOLERANCE, touch_at_force, unreachable
from .penetration import PenetrationError
from .placement import FRICTION, Placement, on_gel, pose_at
from .sharpness import sharpest
from .solids.finite_strain import FiniteStrainSolid, State
from .thickness import DEPTH_LIMIT, thickness_under

Tier = Literal["fast", "full", "reference"]
TIERS: tuple[Tier, ...] = ("fast", "full", "reference")

_LEAST_FORCE = 1e-6  # N, the weight of 0.1 mg: less is lost in rounding and the lattice's own roughness
_REACHED = 1 / 3  # of the depth that a mesh is made for: contacts less deep are too small for it (assumed)
_ROOM = 1.5  # times the depth at the largest force, for which a mesh is made: places on a path differ (assumed)
_MOST_MESHES = 3
# Of the full tier's spacing, where its own mesh finds no contact: 8 of 14 rings at random depths settled then, and five
# of five deeper than their wire's radius that had not, or had gone through.
_FINER = 0.5
# Of load steps without friction, on the tier's own mesh and on the finer one, before another way is shorter (assumed).
_FEW_FAILURES = 4, 2
_FARTHEST_SLIDE = 10e-3  # m, half of the gel


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
    between : (m, 3) N, what the indenter's force on the surface between nodes is on the solid's nodes, if there is any
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
    between: np.ndarray | None = None


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

    sensor : ``"biotac"`` or ``"digit"``; indenter : of ``tactile.indenters``, in m; place : a ``tactile.Placement``
    depth, force : one of the two: m beyond first touch, or N
    tier : ``fast`` is linear with a learned correction (milliseconds), ``full`` finite strain on a mesh graded round
        the contact (seconds; with friction ten or more; a minute or more for indenters that need a finer mesh),
        ``reference`` the same on cells half as large (minutes)
    friction : Coulomb's coefficient, 0 or more

    Returns a :class:`Solution`: ``displacement`` (n_nodes, 3) m, ``force`` (3,) N, ``depth`` m, ``pressure`` Pa, and
    the errors expected of the tier.
    Raises TactileError for an impossible request, or for one beyond what the tier finds.

    >>> ball = tactile.indenters.Sphere(radius=3e-3)
    >>> contact = tactile.solve("digit", ball, tactile.Placement(x=-6e-3, z=0.0), force=2.0)
    >>> contact.depth, contact.displacement.shape
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
    if step.force is not None and 0 < step.force < _LEAST_FORCE:
        raise TactileError("solve, force", f"{step.force:g} N", f"0, or at least {_LEAST_FORCE:g} N", "Press more")
    if step.depth is not None and step.depth > limit:
        expected = f"at most {limit * 1e3:.2f} mm, {DEPTH_LIMIT:.0%} of the thickness here"
        raise TactileError("solve, depth", f"{step.depth * 1e3:g} mm", expected, "Press less")
    if not (np.isfinite(step.slide).all() and np.abs(step.slide).max() <= _FARTHEST_SLIDE):
        found = f"{tuple(1e3 * s for s in step.slide)} mm"
        raise TactileError("solve, slide", found, f"two lengths of at most {_FARTHEST_SLIDE * 1e3:g} mm")


class _Path:
    """A path of one indenter on one sensor; ``to`` goes on from the step before."""

    def __init__(
        self, sensor: Sensor, indenter: Indenter, pose: Pose, thick: float, steps: list[Step], tier: Tier,
        friction: float,
    ) -> None:  # fmt: skip
        self.sensor, self.indenter, self.pose, self.tier, self.friction = sensor, indenter, pose, tier, friction
        self.thickness, self.limit = thick, DEPTH_LIMIT * thick
        self.where = f"solve, {sensor}, {tier} tier"
        self.deepest = max((step.depth for step in steps if step.depth is not None), default=0.0)
        self.hardest = max((step.force for step in steps if step.force), default=0.0)

    def errors(self, depth: float) -> tuple[float, float]:
        """Errors of a contact at a depth, m: see ``Solution``."""
        return expected_error(self.tier, self.sensor, depth / self.thickness)


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
                raise unreachable(self.where, step.force, self.limit)
        else:
            found = self.press.at_depth(step.depth or 0.0, pose)
        contact, corrected = found.linear, found.corrected
        patch = np.zeros(len(compliance.surface.rest), bool)
        patch[compliance.touchable[contact.nodes]] = True
        near = compliance.touchable[self.press.problem.nodes_near]
        radius = sharpest(self.indenter, contact.pose, compliance.surface.rest[near] + contact.displacement[near])
        stated = error_estimate.of_fast(self.errors(contact.depth), found.depth, len(contact.nodes), radius)
        return Solution(
            "fast", contact.converged, contact.iterations, corrected.displacement, patch, found.force, contact.depth,
            found.pressure, *stated, contact.penetration,
            float(contact.slipping.mean()) if len(contact.slipping) and self.friction else 0.0, len(contact.core_nodes),
        )  # fmt: skip


class _FiniteStrain(_Path):
    body: Body
    problem: FiniteStrainContact

    def __init__(self, *arguments) -> None:  # noqa: ANN002
        super().__init__(*arguments)
        self.spacing = 1.0  # of the mesh's nodes, over the tier's own
        self.way: list[Pose] = []  # what was solved, which friction remembers
        self.made_for = self._reach()
        self._make(self.made_for, self.friction)

    def _reach(self) -> float:
        """The depth, m, that the mesh is to be made for: for forces found without friction, on meshes that were made
        for greater depths, and are coarser."""
        if not self.hardest:
            return self.deepest
        reach = self.limit
        for _ in range(_MOST_MESHES):
            self._make(reach, 0.0)
            try:
                depth = self._at_force(self.pose, self.hardest, ROUGH).depth
            except TactileError:  # with friction there may be an equilibrium
                break
            if depth > _REACHED * reach:
                break
            reach = _ROOM * depth
        return max(reach, self.deepest)

    def _make(self, deepest: float, friction: float) -> None:
        """The mesh for contacts of a depth, m, with nothing pressed yet."""
        self.body = graded_body(self.sensor, self.indenter, self.pose, deepest, self.tier, self.spacing)
        self.problem = self.body.contact(self.indenter, self.pose, deepest, friction)
        self.step = FRICTION_STEP if friction or self.spacing < 1 else ONE_STEP
        if self.tier == "full" and not friction:
            self.problem.most_failures = _FEW_FAILURES[self.spacing < 1]
        self.last = self.problem.start()

    def to(self, step: Step) -> Solution:
        """See ``solve_path``. Where the full tier's mesh does not hold the indenter, on a finer one from the start."""
        try:
            found = self._to(step)
        except (NoEquilibriumError, PenetrationError):
            if self.tier != "full" or self.spacing < 1:
                raise
            self._refine()
            found = self._to(step)
        self.way.append(self.last.pose)
        return found

    def _refine(self) -> None:
        self.spacing = _FINER
        self._make(self.made_for, self.friction)
        for pose in self.way if self.friction else ():
            self.last = self.problem.move(pose, self.last, self.step)

    def _to(self, step: Step) -> Solution:
        pose = self.pose.slid(*step.slide)
        if step.force:
            self.last = self._at_force(pose, step.force)
        elif step.depth or self.last.depth:
            self.last = self.problem.move(pose.moved(step.depth or 0.0), self.last, self.step)
        return self._solution(self.last)

    def _at_force(self, pose: Pose, force: float, tolerance: float = TOLERANCE) -> ContactState:
        """The contact at a force, N, along the motion; tolerance : relative, of the force."""

        def move(depth: float, before: ContactState) -> ContactState:
            return self.problem.move(pose.moved(depth), before, self.step)

        return touch_at_force(move, self.last, pose.direction, force, self.limit, self.where, tolerance)

    def _solution(self, touch: ContactState) -> Solution:
        below = self.body.penetration_depth(touch, self.indenter)
        gap = touch.outer.gaps(self.body.solid.mesh.nodes + touch.state.displacement)
        table, across = self.errors(touch.depth), self._nodes_across(touch)
        stated = error_estimate.of_finite_strain(table, touch.depth, int((touch.pressing > 0).sum()), across, below)
        slips = touch.outer.slipping[touch.outer.active]
        return Solution(
            self.tier, True, touch.iterations, self.body.displacement(touch), self.body.contact_patch(touch),
            touch.force, touch.depth, touch.fluid, *stated, float(-gap.min(initial=0.0)),
            float(slips.mean()) if len(slips) and self.friction else 0.0, len(touch.inner.nodes), touch.steps,
            (self.body.solid, touch.state), touch.push.loads(len(touch.state.displacement)) if touch.guarded else None,
        )  # fmt: skip

    def _nodes_across(self, touch: ContactState) -> float:
        """Count the nodes of the full tier's mesh across the contact where the indenter is sharpest."""
        mesh = self.body.solid.mesh
        rest = mesh.nodes[mesh.surface]
        nearest = rest[int(np.argmin(touch.pose.distance(self.indenter, rest)[0]))]
        spacing = float(np.partition(np.linalg.norm(rest - nearest, axis=1), 1)[1])
        radius = sharpest(self.indenter, touch.pose, rest + touch.state.displacement[mesh.surface])
        spacing *= 1 if self.tier == "full" else 2
        return float(2 * np.sqrt(min(radius, 1.0) * max(touch.depth, 0.0)) / spacing)
