"""One door to contact mechanics: a sensor, an indenter at a place, a depth or a force, and a tier."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np

from .. import biotac_shape, sensors
from ..errors import TactileError
from ..indenters import Indenter, Pose
from .cavity import Cavity
from .compliance import biotac_compliance, digit_compliance
from .contact import fluid_pressure, surface_displacement
from .finite_strain import FiniteStrainSolid
from .hex_mesh import HexMesh, gel_mesh, skin_mesh
from .newton import FiniteStrainContact, Touch
from .press import MAX_DEPTH, Placement, Press, biotac_pose, digit_pose, on_gel

Sensor = Literal["biotac", "digit"]
Tier = Literal["fast", "reference"]

LOAD_STEP = {"biotac": 0.3e-3, "digit": 0.2e-3}  # m; Newton's method takes 5 or 6 iterations a step of this size
_REACH = 1.5e-3  # m, nodes this far outside the indenter at the greatest depth may come to touch it
_FORCE_TOLERANCE = 1e-4  # relative, of the reference tier's search for a force
_SEARCH_STEPS = 12


@dataclasses.dataclass(frozen=True)
class Solution:
    """A solved contact, SI units, whatever the tier.

    tier : which solver made it; converged : whether it may be used; iterations : of its last step
    displacement : (n, 3) m of the sensor's surface nodes; contact_patch : (n,) bool, nodes that carry force
    force : (3,) N, exerted by the indenter on the sensor; depth : m from first touch
    pressure : Pa, rise of the BioTac's fluid pressure, 0 for the DIGIT
    """

    tier: Tier
    converged: bool
    iterations: int
    displacement: np.ndarray
    contact_patch: np.ndarray
    force: np.ndarray
    depth: float
    pressure: float


def solve(
    sensor: Sensor,
    indenter: Indenter,
    place: Placement,
    *,
    depth: float | None = None,
    force: float | None = None,
    tier: Tier = "fast",
) -> Solution:
    """Press ``indenter`` into ``sensor`` at ``place`` to a depth, m, or a force along the motion, N.

    ``fast`` is linear (milliseconds, right for small depths), ``reference`` finite strain on the same mesh (minutes).
    Raises TactileError for an impossible request, or for one beyond what the tier may be asked.
    """
    _check(depth, force)
    pose = _pose(sensor, indenter, place)
    if force == 0:
        depth, force = 0.0, None
    if tier == "fast":
        return _fast(sensor, indenter, pose, depth, force)
    problem = _problem(sensor, indenter, pose)
    touch = problem.press(depth, step=LOAD_STEP[sensor]) if force is None else _at_force(problem, sensor, force)
    return _solution(sensor, problem, touch)


def solve_path(
    sensor: Sensor, indenter: Indenter, place: Placement, depths: Iterable[float], tier: Tier = "fast"
) -> Iterator[Solution]:
    """Solutions at growing depths, m, each going on from the one before; those already yielded are kept on an error.

    Raises what ``solve`` raises.
    """
    pose = _pose(sensor, indenter, place)
    problem, touch = (_problem(sensor, indenter, pose), None) if tier == "reference" else (None, None)
    for depth in depths:
        _check(depth, None)
        if problem is None:
            yield _fast(sensor, indenter, pose, depth, None)
            continue
        touch = problem.press(depth, touch, LOAD_STEP[sensor])
        yield _solution(sensor, problem, touch)


def _pose(sensor: Sensor, indenter: Indenter, place: Placement) -> Pose:
    if not on_gel(place.x, place.z):
        found = f"({place.x * 1e3:g}, {place.z * 1e3:g}) mm"
        raise TactileError("solve, place", found, "a place on the DIGIT's gel (x, z), see digit_shape.outline_distance")
    return (biotac_pose if sensor == "biotac" else digit_pose)(indenter, place)


def _check(depth: float | None, force: float | None) -> None:
    if (depth is None) == (force is None):
        raise TactileError("solve", f"depth {depth!r} and force {force!r}", "one of the two")
    name, value, unit = ("depth", depth, "m") if force is None else ("force", force, "N")
    if not (np.isfinite(value) and value >= 0):
        raise TactileError(f"solve, {name}", f"{value!r} {unit}", "zero or more, and finite")
    if depth is not None and depth > MAX_DEPTH:
        raise TactileError("solve, depth", f"{depth * 1e3:g} mm", f"at most {MAX_DEPTH * 1e3:g} mm",
                           "Deeper contacts are not modelled yet")  # fmt: skip


def _fast(sensor: Sensor, indenter: Indenter, pose: Pose, depth: float | None, force: float | None) -> Solution:
    compliance = biotac_compliance() if sensor == "biotac" else digit_compliance()
    press = Press(compliance, indenter, pose)
    contact = press.at_force(force) if depth is None else press.at_depth(depth)
    if contact is None:
        found = f"force {force:g} N" if depth is None else f"depth {depth * 1e3:g} mm"
        expected = f"at most {MAX_DEPTH * 1e3:g} mm deep, and the skin clear of its core"
        raise TactileError(f"solve, {sensor}, fast tier", found, expected, "Press less")
    patch = np.zeros(len(compliance.surface.rest), bool)
    patch[compliance.touchable[contact.nodes]] = True
    return Solution(
        "fast", contact.converged, contact.iterations, surface_displacement(compliance, contact), patch,
        contact.force, contact.depth, fluid_pressure(compliance, contact),
    )  # fmt: skip


@functools.cache
def _solid(sensor: Sensor) -> tuple[FiniteStrainSolid, Cavity | None]:
    if sensor == "digit":
        return FiniteStrainSolid(gel_mesh(), sensors.DIGIT_GEL), None
    mesh = skin_mesh()
    into_skin = mesh.inner[biotac_shape.skin_surface("inner").faces][:, ::-1]
    return FiniteStrainSolid(mesh, sensors.BIOTAC_SKIN), Cavity(into_skin, len(mesh.nodes))


def _problem(sensor: Sensor, indenter: Indenter, pose: Pose) -> FiniteStrainContact:
    solid, cavity = _solid(sensor)
    distance, _ = pose.moved(MAX_DEPTH).distance(indenter, solid.mesh.nodes[solid.mesh.surface])
    return FiniteStrainContact(solid, solid.mesh.surface[distance < _REACH], indenter, pose, cavity)


def _at_force(problem: FiniteStrainContact, sensor: Sensor, force: float) -> Touch:
    """The contact at a force along the motion, by regula falsi on F^(2/3), which is nearly straight in the depth."""
    touch, below = problem.start(), (0.0, 0.0)
    direction = problem.pose.direction
    goal = force ** (2 / 3)
    depth = LOAD_STEP[sensor] / 2
    for _ in range(_SEARCH_STEPS):
        if depth > MAX_DEPTH:
            raise TactileError("solve, force", f"{force:g} N", f"a force within {MAX_DEPTH * 1e3:g} mm", "Lower it")
        touch = problem.press(depth, touch if touch.depth < depth else None, LOAD_STEP[sensor])
        found = max(float(touch.force @ direction), 0.0)
        if abs(found - force) <= _FORCE_TOLERANCE * force:
            return touch
        root = found ** (2 / 3)
        slope = max((root - below[1]) / (depth - below[0]), 1e-6)  # no node is touched yet: go on by a whole step
        if root < goal:
            below = (depth, root)
        depth = depth + float(np.clip((goal - root) / slope, -depth / 2, LOAD_STEP[sensor]))
    raise TactileError("solve, force", f"{found:g} N after {_SEARCH_STEPS} steps", f"{force:g} N", "Give a depth")


def _solution(sensor: Sensor, problem: FiniteStrainContact, touch: Touch) -> Solution:
    mesh = problem.solid.mesh
    if sensor == "biotac" and _core_gap(mesh, touch.state.displacement) < 0:
        found = f"the skin goes through its core at {touch.depth * 1e3:g} mm"
        raise TactileError("solve, biotac, reference tier", found, "a skin clear of its core", "Press less")
    patch = np.isin(mesh.surface, touch.nodes)
    displacement = touch.state.displacement[mesh.surface]
    return Solution("reference", True, touch.iterations, displacement, patch, touch.force, touch.depth, touch.fluid)


def _core_gap(mesh: HexMesh, displacement: np.ndarray) -> float:
    """Smallest distance, m, along the radius between core and free inner skin; contact there is not modelled."""
    free = mesh.inner[~mesh.clamped[mesh.inner]]
    x, y, z = (mesh.nodes[free] + displacement[free]).T
    angle = np.arctan2(z, biotac_shape.AXIS_Y - y)
    pad = np.abs(angle) < biotac_shape.PAD_ANGLE  # beyond it the skin rests beside the core, 0.2 mm away or less
    gap = np.hypot(y - biotac_shape.AXIS_Y, z) - biotac_shape.core_radius(x, angle)
    return float(np.nanmin(gap[pad]))
