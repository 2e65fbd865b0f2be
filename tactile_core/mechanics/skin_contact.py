"""Find the contact that has displaced a surface: the traction on it, and the body that is pressed into it.

In the patch displacements are known and tractions are not; elsewhere the traction is zero. The sensor's linear
compliance among the patch's nodes is inverted, regularised by a soft layer against noise of single nodes; nodes that
would pull are released.

The body is found by mechanics alone, so also on parts of the pad that no network was trained on. The node of a skin
that is displaced most was touched first and sticks: it has moved as the body has, which gives depth and lean. Each
candidate body is pressed into the skin in this way, and moved until its load is centred where the skin's is. The one
whose dent is most similar is returned, with its force.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..errors import TactileError, numbers
from ..geometry.indenters import Indenter, Sphere
from ..geometry.indenters.indenter import tangents
from ..sensors.unrolling import roll_up, unrolled_nodes
from .fast.compliance import compliance_of
from .fast.compliance_rows import ComplianceRows
from .node_areas import node_areas
from .placement import MOST_TILT, Placement
from .solution import Solution
from .solve import solve

# The layer's compliance, m/Pa, over the sensor's thickness / modulus. On gels solved at finite strain, nine indenters,
# the force was 6.0 % off in the median, with 0.01 7.5 %, 0.03 12.9 %; on translated gels of the shipped recording
# 0.0001 to 0.01 agreed to half a per cent.
_LAYER = 1e-3


def pressing_traction(sensor: str, displacement: np.ndarray, patch: np.ndarray) -> np.ndarray:
    """Return the traction (n, 3) Pa on a resting surface under displacement (n, 3) m, touched in ``patch`` (n,) bool.

    Nodes of the patch that cannot be touched, or would pull, carry none. Linear elasticity of a gel, or of a BioTac's
    skin with its fluid, without the core."""
    compliance, areas = compliance_of(sensor), node_areas(sensor)
    outward = sensors.rest_normals(sensor)
    nodes = np.flatnonzero(patch[compliance.touchable])
    found, pulling = np.zeros(displacement.shape), True
    while len(nodes) and pulling:
        at = compliance.touchable[nodes]
        pressed = _solved(sensor, ComplianceRows(compliance, nodes).block(nodes), areas[at], displacement[at])
        inward = np.einsum("ki,ki->k", pressed, outward[at]) < 0
        pulling = not inward.all()
        if pulling:
            nodes = nodes[inward]
        else:
            found[at] = pressed
    return found


def _solved(sensor: str, block: np.ndarray, areas: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Return the traction (k, 3) Pa on nodes with areas (k,) m2 under displacement (k, 3) m.

    block : (3 k, 3 k) m/N. Scaled by the areas' square roots, the system is symmetric and the layer uniform."""
    material, thickness = sensors.describe(sensor).material, sensors.thickness(sensor)
    root = np.repeat(np.sqrt(areas), 3)
    matrix = block.astype(float) * root[:, None] * root
    matrix.flat[:: len(root) + 1] += _LAYER * thickness / material.youngs
    return (np.linalg.solve(matrix, root * displacement.ravel()) / root).reshape(-1, 3)


# m, least and largest radius of the ball: half the smallest, twice the largest that networks are trained on (assumed).
RADII = 1.5e-3, 14e-3
LEAST_NODES = 5  # of a patch, one more than a paraboloid needs; smaller patches get the usual radius
USUAL_RADIUS = 4e-3  # m, the median of translated patches of the test contacts


@dataclass(frozen=True)
class BodyContact:
    """A body pressed into a sensor. body : its shape; place : its place and lean; force : N, along its motion"""

    body: Indenter
    place: Placement
    force: float

    def on_gel(self, sensor: str = sensors.TARGET) -> Solution:
        """Solve the contact on a gel, in the fast tier.

        Raises TactileError for a place off the gel, and for a force beyond its greatest depth.
        """
        return solve(sensor, self.body, self.place, force=self.force)


def leaning(x: float, z: float, motion: np.ndarray, outward: np.ndarray) -> Placement:
    """Return the placement at ``x``, ``z``, m, of a press along the vector ``motion`` (3,), of any length, into a
    surface with outward unit normal ``outward`` (3,); its tilt is cut to 0.8 rad."""
    along, side = tangents(outward)
    up = -motion / np.linalg.norm(motion)
    tilt = float(np.arccos(np.clip(up @ outward, -1, 1)))
    heading = float(np.arctan2(up @ side, up @ along))
    return Placement(x, z, min(tilt, MOST_TILT), heading)


def patch_radius(points: np.ndarray, outward: np.ndarray) -> float:
    """Return the radius, m, of the ball whose paraboloid fits a pressed patch best, 1.5 to 14 mm; 4 mm for under 5
    nodes.
    points : (k, 3) m, the patch's nodes, displaced; outward : (3,), normal of the patch"""
    if len(points) < LEAST_NODES:
        return USUAL_RADIUS
    height = outward / np.linalg.norm(outward)
    axes = np.stack([*tangents(height), height], axis=1)
    x, z, y = ((points - points.mean(axis=0)) @ axes).T
    terms = np.stack([np.ones_like(x), x, z, 0.5 * (x * x + z * z)], axis=1)
    curvature = np.linalg.lstsq(terms, y, rcond=None)[0][3]  # 1/m; the ball's deepest point lies lowest
    return float(1 / np.clip(curvature, 1 / RADII[1], 1 / RADII[0]))


SENSOR = sensors.SOURCE
# A node may be in contact above this share of the deepest node's inward displacement, as skin is dented far beside the
# few nodes in contact; it is from this share of the largest pressure on (median IoU with true patches 0.7, also with
# 0.4). Chosen on a quarter of the test contacts.
MAYBE, PRESSED = 0.4, 0.2
# Share of the deepest node's inward displacement above which dents are compared; the best of .4 to .85 on a sixth of
# the test contacts. Below it the fast and the full tier differ by more than two bodies do.
COMPARED = 0.5
LEAST_COMPARED = 5  # nodes
MOVES = 2  # of each body toward the load's centre: its own is then within .07 mm in the median


@dataclass(frozen=True)
class _Dent:
    """Dent of a skin: displacement (n, 3) m, its inward part (n,) m, pressure (n,) Pa, centre (2,) m of its load."""

    displacement: np.ndarray
    inward: np.ndarray
    pressure: np.ndarray
    centre: np.ndarray

    @property
    def motion(self) -> np.ndarray:
        """Displacement (3,) m of the deepest node, which is the body's since first touch."""
        return self.displacement[self.inward.argmax()]


@dataclass(frozen=True)
class _Trial:
    """A body pressed into the skin at ``aim`` (x, z) m, its dent, and how ``unlike`` that is the one sought, 0 to 1."""

    contact: BodyContact
    aim: np.ndarray
    dent: _Dent
    unlike: float


def skin_contact(displacement: np.ndarray, bodies: Iterable[Indenter] = ()) -> BodyContact:
    """Find the body pressed into a BioTac's skin: the most likely of `likely_contacts`, which raises TactileError.
    displacement : (3650, 3) m of the skin's nodes; bodies : shapes that it may be, beside a ball of any size
    >>> contact = skin_contact(displacement, [tactile.indenters.Sphere(2e-3)])
    >>> gel = contact.on_gel().displacement
    """
    return likely_contacts(displacement, bodies)[0]


def likely_contacts(displacement: np.ndarray, bodies: Iterable[Indenter] = ()) -> list[BodyContact]:
    """Find how each of the bodies would be pressed into a BioTac's skin, by the fast tier; the most likely first.

    displacement : (3650, 3) m of the skin's nodes
    bodies : what may be pressed into it beside a ball, whose radius is found; each takes 20 to 30 ms of CPU, and one
        that cannot be pressed as deep is left out

    Raises TactileError if nothing is pressed on the pad, and if no body can be pressed as deep.
    """
    dent = _dent(displacement)
    trials = [each for body in (*bodies, _ball(dent)) if (each := _trial(dent, body, dent.centre))]
    if not trials:
        found = f"a dent of {1e3 * np.linalg.norm(dent.motion):.2g} mm"
        raise TactileError("skin's displacement", found, "one that the fast tier reaches")
    for _ in range(MOVES):
        trials = [_moved(dent, each) for each in trials]
    return [trial.contact for trial in sorted(trials, key=lambda trial: trial.unlike)]


def _dent(displacement: np.ndarray) -> _Dent:
    """Describe the dent of a skin under displacement (n, 3) m. Raises TactileError if nothing presses on the pad, and
    for another shape, the wrong sign, or values that are not finite."""
    displacement, outward = numbers(displacement, "skin's displacement"), sensors.rest_normals(SENSOR)
    if (other := displacement.shape != outward.shape) or not np.isfinite(displacement).all():
        found = f"shape {displacement.shape}" if other else "values that are not finite"
        raise TactileError("skin's displacement", found, f"{outward.shape} m, of one frame")
    inward = -np.einsum("ni,ni->n", displacement, outward)
    if -inward.min() > inward.max():
        found = f"up to {-1e3 * inward.min():.2f} mm out of the skin, {1e3 * inward.max():.2f} mm into it"
        raise TactileError("skin's displacement", found, "a pressed skin", "Change its sign")
    traction = pressing_traction(SENSOR, displacement, inward > MAYBE * max(inward.max(), 0.0))
    pressure = np.maximum(-np.einsum("ni,ni->n", traction, outward), 0)
    places = unrolled_nodes(SENSOR)
    load = np.where(np.isfinite(places[:, 0]), pressure * node_areas(SENSOR), 0)
    if not load.sum() > 0:
        raise TactileError("skin's displacement", "no pressed node", "a dent on the pad")
    return _Dent(displacement, inward, pressure, load @ np.nan_to_num(places) / load.sum())


def _ball(dent: _Dent) -> Sphere:
    """Return the ball that fits the pressed patch."""
    surface = sensors.sensor_surface(SENSOR)
    outward = sensors.rest_normals(SENSOR)
    patch = dent.pressure > PRESSED * dent.pressure.max()
    return Sphere(patch_radius(surface.rest[patch] + dent.displacement[patch], outward[patch].mean(axis=0)))


def _trial(dent: _Dent, body: Indenter, aim: np.ndarray) -> _Trial | None:
    """Press a body at ``aim`` (x, z) m, as deep and leaning as the dent's deepest node has moved, which sticks to it;
    return None if that is impossible, or touches no node."""
    place = leaning(float(aim[0]), float(aim[1]), dent.motion, roll_up(aim, SENSOR)[1])
    try:
        solution = solve(SENSOR, body, place, depth=float(np.linalg.norm(dent.motion)))
        made = _dent(solution.displacement)
    except TactileError:
        return None
    return _Trial(BodyContact(body, place, float(np.linalg.norm(solution.force))), aim, made, _unlike(made, dent))


def _moved(dent: _Dent, trial: _Trial) -> _Trial:
    """Press a trial's body again, its aim moved by the offset between load centres; return the likelier trial."""
    after = _trial(dent, trial.contact.body, trial.aim + dent.centre - trial.dent.centre)
    return trial if after is None or after.unlike > trial.unlike else after


def _unlike(made: _Dent, sought: _Dent) -> float:
    """Return how unlike two dents are around the deepest node of the one sought, 0 (alike) to 1.

    Only their form counts, without mean and scale: depth is known, and finite strain changes both.
    """
    count = max(int((sought.inward > COMPARED * sought.inward.max()).sum()), LEAST_COMPARED)
    near = np.argsort(-sought.inward, kind="stable")[:count]
    first, second = (each.displacement[near] - each.displacement[near].mean(axis=0) for each in (made, sought))
    product = np.vdot(first, second) / max(np.linalg.norm(first) * np.linalg.norm(second), 1e-300)
    return float(np.sqrt(max(1 - product**2, 0)))
