"""A rigid body pressed into a sensor: place, lean and curvature, estimated from the displacement of the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..geometry.indenters import Indenter
from ..geometry.indenters.pose import tangents
from .placement import Placement
from .solution import Solution
from .solve import solve

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
