"""Solve contacts, the entry point of mechanics: a sensor, an indenter at a place, a depth or a force, and a tier."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator

import numpy as np

from .. import sensors
from ..errors import TactileError, finite_number
from ..files.installed import needing
from ..geometry.indenters import Indenter, Pose, as_indenter
from . import error_estimate
from .electrodes.biotac_sheet import sensing_films
from .fast.compliance import compliance_of
from .fast.contact_state import Contact
from .fast.press import CorrectedPress
from .finite_strain.load_path import LoadPath
from .force_search import MOST_FORCE, UnreachableError, unreachable
from .node_areas import traction
from .penetration import RESOLVED_RADIUS, sharpest
from .placement import DEPTH_LIMIT, FRICTION, Placement, first_touch, friction_of, on_gel, pose_at, thickness_under
from .solution import TIERS, OnDemand, Sensor, Solution, Step, Tier, centre_of_pressure

_LIGHTEST = 1e-6  # N, least force: smaller ones are lost in rounding and the lattice's roughness
_FARTHEST_SLIDE = 10e-3  # m, half of the gel
FROM_INSIDE = 0.5  # cosine, 60 degrees, of a push to the outward normal where it first touches (assumed)


def solve(
    sensor: Sensor,
    indenter: Indenter,
    place: Placement | Pose,
    *,
    depth: float | None = None,
    force: float | None = None,
    tier: Tier = "fast",
    friction: float = FRICTION,
) -> Solution:
    """Press ``indenter`` into ``sensor`` at ``place`` to a depth, m, or a force along the motion, N.

    sensor : name of a sensor, such as ``"digit"``
    indenter : of ``tactile.indenters``, or a closed ``trimesh.Trimesh``, in m
    place : a ``tactile.Placement``, or the indenter's pose, which is moved in or out to first touch
    depth, force : one of the two: m beyond first touch, or N, found to a thousandth
    tier : ``fast`` is linear with a learned correction (milliseconds), ``full`` finite strain on a mesh graded round
        the contact (seconds; with friction ten or more; a minute or more for indenters that need a finer mesh),
        ``reference`` the same on cells half as large (minutes)
    friction : Coulomb's coefficient, 0 or more

    Returns a :class:`Solution`: ``displacement`` (n_nodes, 3) m, ``force`` (3,) N, ``depth`` m, ``pressure`` Pa, and
    the tier's ``shape_error`` and ``force_error``.
    Raises TactileError for an impossible request, or for one beyond what the tier finds; UnreachableError beyond 60 %
    of the thickness; ModuleNotFoundError without the extra [fem].

    >>> ball = tactile.indenters.Sphere(radius=3e-3)
    >>> contact = tactile.solve("digit", ball, tactile.Placement(x=-6e-3, z=0.0), force=2.0)
    >>> contact.depth, contact.displacement.shape
    """
    with needing("fem"):
        if isinstance(place, Pose):
            place.check("solve, place")
            surface, indenter = sensors.sensor_surface(sensor), as_indenter(indenter)
            place = first_touch(surface, indenter, place)
            node = int(np.argmin(place.distance(indenter, surface.rest)[0]))
            if place.direction @ sensors.rest_normals(sensor)[node] > FROM_INSIDE:
                found = f"a push along {place.direction.tolist()}, which comes from inside the sensor"
                raise TactileError("solve, place", found, "a push into it", "Turn the pose, or change push's sign")
        return next(solve_path(sensor, indenter, place, [Step(depth, force)], tier, friction))


def solve_path(
    sensor: Sensor,
    indenter: Indenter,
    place: Placement | Pose,
    steps: Iterable[Step],
    tier: Tier = "fast",
    friction: float = FRICTION,
    limit: float | None = None,
) -> Iterator[Solution]:
    """Yield the solution of each step of a path; with friction each depends on the steps before.
    sensor, indenter, place, tier, friction : as in ``solve``
    steps : taken one by one in the fast tier; all at once in the others, whose mesh is made for the deepest
    limit : m, the greatest depth (default: 60 % of the thickness there)
    Raises what ``solve`` raises; solutions already yielded hold."""
    if tier not in TIERS:
        raise TactileError("solve, tier", repr(tier), "fast, full or reference")
    friction = friction_of(friction, "solve, friction")
    indenter = as_indenter(indenter)
    pose = place if isinstance(place, Pose) else _first_touch(sensor, indenter, place)
    thick = thickness_under(sensor, indenter, pose)
    limit = DEPTH_LIMIT * thick if limit is None else limit
    if tier == "fast":
        fast = _Fast(sensor, indenter, pose, thick, limit, friction)
        for step in steps:
            _check(step, limit)
            yield fast.to(step)
        return
    steps = list(steps)
    for step in steps:
        _check(step, limit)
    guesses = _guessed_depths(sensor, indenter, pose, steps, limit, friction)
    path = LoadPath(sensor, indenter, pose, thick, limit, guesses, tier, friction)
    for step, guess in zip(steps, guesses, strict=True):
        yield path.to(step, guess)


def _first_touch(sensor: Sensor, indenter: Indenter, place: Placement) -> Pose:
    if not isinstance(place, Placement):
        advice = "Placement(x=..., z=...)"
        raise TactileError("solve, place", f"{place!r:.80}", "a tactile.Placement, or a Pose", advice)
    # the part of the pad that unrolls onto it can be touched
    gel = sensor if sensors.is_gel(sensor) else sensors.TARGET
    if not on_gel(place.x, place.z, sensor=gel):
        found = f"({place.x * 1e3:g}, {place.z * 1e3:g}) mm"
        advice = f"tactile_core.sensors.shape_of({gel!r}).outline_distance says how far inside a place is"
        raise TactileError("solve, place", found, f"a place (x, z) on the {sensors.title(gel)}'s gel", advice)
    return pose_at(sensor, indenter, place)


def _check(step: Step, limit: float) -> None:
    name, value, unit = ("depth", step.depth, "m") if step.force is None else ("force", step.force, "N")
    if (step.depth is None) == (step.force is None):
        raise TactileError("solve", f"depth {step.depth!r} and force {step.force!r}", "one of the two")
    finite_number(value, f"solve, {name}", f"{unit}, zero or more, and finite", 0.0)
    if step.force is not None and 0 < step.force < _LIGHTEST:
        raise TactileError("solve, force", f"{step.force:g} N", f"0, or at least {_LIGHTEST:g} N", "Press more")
    if step.force is not None and step.force > MOST_FORCE:
        raise unreachable("solve", step.force, limit)
    if step.depth is not None and step.depth > limit:
        expected = f"at most {limit * 1e3:.2f} mm, {DEPTH_LIMIT:.0%} of the thickness here"
        raise UnreachableError("solve, depth", f"{step.depth * 1e3:g} mm", expected, "Press less")
    if not (np.isfinite(step.slide).all() and np.abs(step.slide).max() <= _FARTHEST_SLIDE):
        found = f"{tuple(1e3 * s for s in step.slide)} mm"
        raise TactileError("solve, slide", found, f"two lengths of at most {_FARTHEST_SLIDE * 1e3:g} mm")


def _guessed_depths(
    sensor: Sensor, indenter: Indenter, pose: Pose, steps: list[Step], limit: float, friction: float
) -> list[float]:
    """Return the steps' depths, m: given ones, or those at which the fast tier reaches given forces; the limit, m, for
    the first force that it does not reach and forces after it. friction : Coulomb's coefficient"""
    if not any(step.force for step in steps):
        return [step.depth or 0.0 for step in steps]
    fast = _Fast(sensor, indenter, pose, 1.0, limit, friction)  # any thickness: only errors, not asked for, need it
    depths = []
    try:
        for step in steps:
            depths.append(fast.to(step).depth)
    except TactileError:
        pass
    return depths + [limit if step.force else step.depth or 0.0 for step in steps[len(depths) :]]


class _Fast:
    """A path in the fast tier; each call of ``to`` starts from the contact before. pose : at first touch
    thick : m, of the sensor there; limit : m, the greatest depth; friction : Coulomb's coefficient"""

    def __init__(
        self, sensor: Sensor, indenter: Indenter, pose: Pose, thick: float, limit: float, friction: float
    ) -> None:
        self.sensor, self.pose, self.thickness, self.limit = sensor, pose, thick, limit
        self.press = CorrectedPress(compliance_of(sensor), indenter, pose, limit, friction)

    def to(self, step: Step) -> Solution:
        """Solve the next step of the path; a given force is that after the learned correction."""
        pose, compliance = self.pose.slid(*step.slide), self.press.compliance
        if step.force:
            found = self.press.at_force(step.force, pose)
            if found is None:
                raise unreachable(f"solve, {self.sensor}, fast tier", step.force, self.limit)
        else:
            found = self.press.at_depth(step.depth or 0.0, pose)
        contact, problem = found.linear, self.press.problem
        touching = compliance.touchable[contact.nodes]
        patch = np.zeros(len(compliance.surface.rest), bool)
        patch[touching] = True
        near = compliance.touchable[problem.nodes_near]
        return Solution(
            "fast", contact.converged, contact.iterations, found.corrected.displacement, patch, self.thickness,
            found.force, found.axial_force, contact.depth, found.pressure,
            centre_of_pressure(compliance.surface.rest[touching], contact.nodal_force), contact.penetration,
            float(contact.slipping.mean()) if len(contact.slipping) and problem.friction else 0.0,
            len(contact.core_nodes),
            OnDemand(
                electrode_gaps=lambda: contact.electrode_gaps,
                films=functools.partial(_films, self.sensor, contact),
                traction=lambda: traction(self.sensor, touching, found.corrected.factor * contact.nodal_force),
                errors=functools.partial(
                    _fast_errors, self.sensor, self.thickness, contact, found.depth, problem.indenter, near
                ),
            ),
        )  # fmt: skip


def _films(sensor: Sensor, contact: Contact) -> np.ndarray:
    return np.empty(0) if sensors.is_gel(sensor) else sensing_films(contact)


def _fast_errors(
    sensor: Sensor, thick: float, contact: Contact, depth: float, indenter: Indenter, near: np.ndarray
) -> tuple[float, float]:
    table = error_estimate.expected_error("fast", sensor, contact.depth / thick)
    moved = contact.compliance.surface.rest[near] + contact.displacement[near]
    radius = sharpest(indenter, contact.pose, moved)
    shape, force = error_estimate.of_fast(table, depth, len(contact.nodes), radius)
    return shape + (
        error_estimate.unsure_side(contact, sensors.rest_normals(sensor), radius) if radius < RESOLVED_RADIUS else 0.0
    ), force
