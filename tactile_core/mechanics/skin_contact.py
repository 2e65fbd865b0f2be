"""Find the contact that a displaced surface shows: the traction on it, and the body that is pressed into it.

In contact the displacement is given and the traction unknown; beside it the traction is zero. The sensor's linear
compliance among the patch's nodes is inverted, with a soft layer on it that keeps noise of single nodes out; a patch
does not pull, so nodes that would are let go.

The body is found by mechanics alone, with nothing learned: the node of a skin that is displaced most was touched first
and sticks, so it has moved as the body has, which tells depth and lean. Each candidate body is pressed into the skin in
the same way, moved until its load is centred where the skin's is, and the one whose dent is most similar is taken with
its force. So it holds on parts of the pad that no network was trained on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..geometry.indenters import Indenter, Sphere
from ..geometry.indenters.indenter import tangents
from ..sensors.unrolling import roll_up, unrolled_nodes
from .fast.compliance import compliance_of
from .fast.compliance_rows import ComplianceRows
from .node_areas import node_areas
from .placement import Placement
from .solution import Solution
from .solve import solve

# Of the sensor's thickness over its modulus: the layer's give under a pressure. On gels solved at finite strain, nine
# indenters, the sum missed the force by 6.0 % in the median, with 0.01 by 7.5 %, 0.03 by 12.9 %; on translated gels
# of the shipped recording 0.0001 to 0.01 were alike to half a per cent.
_LAYER = 1e-3


def pressing_traction(sensor: str, displacement: np.ndarray, patch: np.ndarray) -> np.ndarray:
    """Return the traction (n, 3) Pa on a resting surface displaced by (n, 3) m and touched in ``patch`` (n,) bool.

    sensor : its name; nodes of the patch that cannot be touched carry none. Linear elasticity, the
    BioTac's fluid included, its core left out.
    """
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
    """Traction (k, 3) Pa of nodes with areas (k,) m2 that are displaced by (k, 3) m.

    block : (3 k, 3 k) m/N. Weighted by the areas' roots it stays symmetric, and the layer is the same everywhere.
    """
    material, thickness = sensors.describe(sensor).material, sensors.thickness(sensor)
    root = np.repeat(np.sqrt(areas), 3)
    matrix = block.astype(float) * root[:, None] * root
    matrix.flat[:: len(root) + 1] += _LAYER * thickness / material.youngs
    return (np.linalg.solve(matrix, root * displacement.ravel()) / root).reshape(-1, 3)


# m, of the ball: half of the smallest and twice of the largest rounding that networks are trained on (assumed).
RADII = 1.5e-3, 14e-3
LEAST_NODES = 5  # of a patch, one more than a paraboloid needs; smaller ones take the usual radius
USUAL_RADIUS = 4e-3  # m, the median of translated patches of the test contacts
LARGEST_TILT = 0.8  # rad, a little more than sticking friction holds: atan(0.78) is 0.66 (assumed)


@dataclass(frozen=True)
class BodyContact:
    """A body pressed into a sensor. body : its shape; place : where, and which way it leans; force : N"""

    body: Indenter
    place: Placement
    force: float

    def on_gel(self, sensor: str = sensors.TARGET) -> Solution:
        """Solve the contact on a gel, in the fast tier.

        Raises TactileError for a place off the gel, and for a force that the gel does not bear.
        """
        return solve(sensor, self.body, self.place, force=self.force)


def leaning(x: float, z: float, motion: np.ndarray, outward: np.ndarray) -> Placement:
    """Return the placement at (x, z) m of a press along ``motion`` (3,) into a surface of normal ``outward`` (3,)."""
    along, side = tangents(outward)
    up = -motion / np.linalg.norm(motion)
    tilt = float(np.arccos(np.clip(up @ outward, -1, 1)))
    heading = float(np.arctan2(up @ side, up @ along))
    return Placement(x, z, min(tilt, LARGEST_TILT), heading)


def patch_radius(points: np.ndarray, outward: np.ndarray) -> float:
    """Radius, m, of the ball whose paraboloid fits a pressed patch best, within ``RADII``; USUAL_RADIUS for few nodes.

    points : (k, 3) m of its nodes, displaced; outward : (3,), normal of the patch
    """
    if len(points) < LEAST_NODES:
        return USUAL_RADIUS
    height = outward / np.linalg.norm(outward)
    axes = np.stack([*tangents(height), height], axis=1)
    x, z, y = ((points - points.mean(axis=0)) @ axes).T
    terms = np.stack([np.ones_like(x), x, z, 0.5 * (x * x + z * z)], axis=1)
    curvature = np.linalg.lstsq(terms, y, rcond=None)[0][3]  # 1/m; the ball's deepest point lies lowest
    return float(1 / np.clip(curvature, 1 / RADII[1], 1 / RADII[0]))


SENSOR = sensors.SOURCE
# Share of the deepest node's inward displacement, above which a node may be pressed: the skin is dented far beside the
# few nodes in contact. And share of the largest pressure, from which on it is (median IoU with true patches 0.7; 0.4 is
# alike). Chosen on a quarter of the test contacts.
MAYBE, PRESSED = 0.4, 0.2
# Share of the deepest node's inward displacement, above which dents are compared; of .4 to .85 the best on a sixth of
# the test contacts. Farther off, the fast tier and the full one differ by more than two bodies do.
COMPARED = 0.5
LEAST_COMPARED = 5  # nodes
MOVES = 2  # of each body toward the load's centre; then it lies within .07 mm in the median


@dataclass(frozen=True)
class _Dent:
    """Dented skin: displacement (n, 3) m, its inward part (n,) m, pressure (n,) Pa, centre (2,) m of its load."""

    displacement: np.ndarray
    inward: np.ndarray
    pressure: np.ndarray
    centre: np.ndarray

    @property
    def motion(self) -> np.ndarray:
        """Displacement (3,) m of the deepest node: that of the body since first touch."""
        return self.displacement[self.inward.argmax()]


@dataclass(frozen=True)
class _Trial:
    """A body pressed into the skin at (x, z) m, the dent that it makes, and how unlike the one sought that is."""

    contact: BodyContact
    aim: np.ndarray
    dent: _Dent
    unlike: float


def skin_contact(displacement: np.ndarray, bodies: Iterable[Indenter] = ()) -> BodyContact:
    """Find the contact of a BioTac's skin displaced by (3650, 3) m: the most likely of `likely_contacts`.

    >>> contact = skin_contact(displacement, [tactile.indenters.Sphere(2e-3)])
    >>> gel = contact.on_gel().displacement
    """
    return likely_contacts(displacement, bodies)[0]


def likely_contacts(displacement: np.ndarray, bodies: Iterable[Indenter] = ()) -> list[BodyContact]:
    """Find how each of the bodies would be pressed into a BioTac's skin, by the fast tier; the most likely first.

    displacement : (3650, 3) m of the skin
    bodies : what may be pressed into it beside a ball, whose radius is found; each takes 20 to 30 ms of CPU, and one
        that cannot be pressed as deep is left out

    Raises TactileError where nothing is pressed on the pad, and where no body can be pressed as deep.
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
    outward = sensors.rest_normals(SENSOR)
    inward = -np.einsum("ni,ni->n", displacement, outward)
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
    """Press a body at ``aim`` (2,) m as the dent shows; None where it cannot be, or touches no node."""
    place = leaning(float(aim[0]), float(aim[1]), dent.motion, roll_up(aim, SENSOR)[1])
    try:
        solution = solve(SENSOR, body, place, depth=float(np.linalg.norm(dent.motion)))
        made = _dent(solution.displacement)
    except TactileError:
        return None
    return _Trial(BodyContact(body, place, float(np.linalg.norm(solution.force))), aim, made, _unlike(made, dent))


def _moved(dent: _Dent, trial: _Trial) -> _Trial:
    """Move a trial by as much as its load is off; returns the likelier of the two."""
    after = _trial(dent, trial.contact.body, trial.aim + dent.centre - trial.dent.centre)
    return trial if after is None or after.unlike > trial.unlike else after


def _unlike(made: _Dent, sought: _Dent) -> float:
    """Return how unlike in form two dents are around the deepest node of the one sought, 0 (alike) to 1.

    Their means are left out and their sizes evened: depth is known, and finite strain changes both.
    """
    count = max(int((sought.inward > COMPARED * sought.inward.max()).sum()), LEAST_COMPARED)
    near = np.argsort(-sought.inward, kind="stable")[:count]
    first, second = (each.displacement[near] - each.displacement[near].mean(axis=0) for each in (made, sought))
    product = np.vdot(first, second) / max(np.linalg.norm(first) * np.linalg.norm(second), 1e-300)
    return float(np.sqrt(max(1 - product**2, 0)))
