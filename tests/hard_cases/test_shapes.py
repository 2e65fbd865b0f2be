"""Indenters that are hard to touch: deep, sharp, concave, two at once, at the rim; both tiers on both sensors.

The full tier is the truth of the fast one, within the error that the fast one states of itself (95 of 100 presses kept
apart lay below). The full tier itself must fulfil the laws of contact; its own truth is the reference tier.
"""

import numpy as np

from hard_cases.case import MECHANICS_FAST, MECHANICS_FULL, Found, case, refusal
from hard_cases.contacts import MIDDLE, broken_fast, broken_full, full, over_stated, press
from tactile_core.geometry.indenters import Box, BumpyCube, Edge, Indenter, Pose, Ring, Several, Sphere
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.mechanics.solve import solve

PAIR = Several(tuple((Sphere(2e-3), Pose(np.array([x, 0.0, 0.0]), np.eye(3))) for x in (-2.5e-3, 2.5e-3)))
CORNER = Placement(-8.2e-3, 1.13e-3, np.radians(35), np.radians(45))
RIM = Placement(-8e-3, 8.6e-3)  # 0.6 mm from the gel's outline
# name -> the difficulty, indenter, place, depth m, friction
CONTACTS: dict[str, tuple[str, Indenter, Placement, float, float]] = {
    "sharp_edge": ("sharp edges and corners", Edge(np.radians(60), 0.1e-3), MIDDLE, 0.3e-3, 0.0),
    "edge": ("sharp edges and corners", Edge(np.radians(60), 0.4e-3), MIDDLE, 0.3e-3, 0.0),
    "sharp_corner": ("sharp edges and corners", Box((14e-3,) * 3, 0.1e-3), CORNER, 0.4e-3, 0.0),
    "ring": ("ring and concave contact", Ring(2.5e-3, 1e-3), MIDDLE, 0.5e-3, 0.0),
    "concave": ("ring and concave contact", BumpyCube(14e-3, 0.5e-3, 1.5e-3, 0.3e-3, 4e-3), MIDDLE, 0.6e-3, 0.0),
    "two_patches": ("two patches at once", PAIR, MIDDLE, 0.5e-3, 0.0),
    "rim": ("contact at the pad's rim and leaving it", Sphere(3.5e-3), RIM, 0.4e-3, 0.0),
    "deep": ("indentation beyond 60 % of the thickness", Sphere(7e-3), MIDDLE, 1.5e-3, 0.0),
}
# Blades between the nodes of lattices 0.35 and 0.5 mm apart, and of meshes 0.5 and 0.8 mm.
SUNK = "sharp_edge"
SHOWN = [name for name in CONTACTS if name != SUNK]
HARD_OF = {name: hard for name, (hard, *_) in CONTACTS.items()}
EACH = [(name, sensor) for name in CONTACTS for sensor in ("digit", "biotac")]


@case("{}_{}_fast", HARD_OF, MECHANICS_FAST,
      "converges and is off the full tier by no more than it states, or says that it cannot", *EACH,
      slow=["biotac", "edge"]
      )  # fmt: skip
def test_fast(name: str, sensor: str) -> Found:
    _, indenter, place, depth, friction = CONTACTS[name]
    if name == SUNK:
        return refusal(lambda: press(sensor, indenter, place, friction).at_depth(depth), "sunk")
    found = press(sensor, indenter, place, friction).at_depth(depth)
    answer = solve(sensor, indenter, place, depth=depth, friction=friction)
    value, words = over_stated(answer, full(sensor, indenter, place, depth, friction))
    return Found(value, "of stated", 1.0, words=words, broken=broken_fast(found, indenter, friction))


@case("{}_{}_full", HARD_OF, MECHANICS_FULL,
      "no node in the indenter or pulled, forces balanced, no cell inside out; or says that it cannot", *EACH,
      slow=["biotac", f"{SUNK}_digit_full", "edge"])  # fmt: skip
def test_full(name: str, sensor: str) -> Found:
    _, indenter, place, depth, friction = CONTACTS[name]
    if name == SUNK:
        return refusal(lambda: full(sensor, indenter, place, depth, friction), "sunk")
    found = full(sensor, indenter, place, depth, friction)
    pose = pose_at(sensor, indenter, place).moved(depth)
    words = f"{np.linalg.norm(found.force):.3g} N, {found.iterations} iterations, {found.load_steps} load steps"
    broken = broken_full(found, sensor, indenter, pose, friction)
    return Found(found.penetration * 1e6, "um", 1.0, words=words, broken=broken)


@case("{}_{}_full_against_reference", HARD_OF, MECHANICS_FULL,
      "differs from the reference tier by no more than it states of itself",
      ("edge", "digit"), ("ring", "digit"), ("two_patches", "digit"), slow=["digit"])  # fmt: skip
def test_against_reference(name: str, sensor: str) -> Found:
    _, indenter, place, depth, friction = CONTACTS[name]
    found = full(sensor, indenter, place, depth, friction)
    truth = solve(sensor, indenter, place, depth=depth, tier="reference", friction=friction)
    value, words = over_stated(found, truth)
    return Found(value, "of stated", 1.0, words=words)
