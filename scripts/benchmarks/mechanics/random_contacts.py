"""Draw contacts at random over a whole sensor, to measure solvers by."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from tactile_core.geometry.indenters import Box, BumpyCube, Cylinder, Indenter, LyingCylinder, Ring, Sphere
from tactile_core.mechanics.placement import Placement, on_gel
from tactile_core.sensors import shape_of

# Diameters and sizes of the published indenters (docs/sources.md, Networks), m; edges, wire and bumps are assumed.
INDENTERS: dict[str, Indenter] = {
    "sphere 3.5": Sphere(1.75e-3),
    "sphere 7": Sphere(3.5e-3),
    "sphere 14": Sphere(7e-3),
    "cylinder 3.5": Cylinder(1.75e-3, 0.4e-3),
    "cylinder 7": Cylinder(3.5e-3, 0.5e-3),
    "lying cylinder 7": LyingCylinder(3.5e-3, 0.5e-3),
    "cube 14": Box((14e-3, 14e-3, 14e-3), 0.5e-3),
    "ring 7": Ring(2.5e-3, 1e-3),
    "bumpy cube 14": BumpyCube(14e-3, 0.5e-3, 1.5e-3, 1e-3, 4e-3),
}
LARGEST_TILT = np.radians(30.0)
DEEPEST = 0.5  # of the thickness at first touch
RIM = 1e-3  # m, places this close to the gel's outline are left out


@dataclasses.dataclass(frozen=True)
class RandomContact:
    """Random contact. name : of the indenter, in ``INDENTERS``
    depth : divided by the thickness at first touch, so that one draw serves both sensors"""

    name: str
    indenter: Indenter
    place: Placement
    depth: float


def random_contacts(count: int, seed: int = 0) -> Iterator[RandomContact]:
    """Draw ``count`` contacts, indenters in turn, each from ``seed`` and its number. Distributions are uniform: of
    places over the gel without its rim, of axes in a cone of 30 degrees, of depths up to half of the thickness."""
    names, digit = list(INDENTERS), shape_of("digit")
    for number in range(count):
        random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        name = names[number % len(names)]
        while True:
            x = random.uniform(digit.tip_x, digit.base_x)
            z = random.uniform(-digit.half_width, digit.half_width)
            if on_gel(x, z, RIM):
                break
        tilt = float(np.arccos(random.uniform(np.cos(LARGEST_TILT), 1)))
        place = Placement(x, z, tilt, float(random.uniform(0, 2 * np.pi)))
        yield RandomContact(name, INDENTERS[name], place, float(random.uniform(0, DEEPEST)))
