"""Contacts that move: sliding to Coulomb's limit, rolling, over the pad's rim and off it."""

import numpy as np

from hard_cases.case import MECHANICS_FAST, MECHANICS_FULL, Found, case, refusal
from hard_cases.contacts import MIDDLE, broken_fast, broken_full, press
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.mechanics.solve import Step, solve_path
from tactile_core.sensors import shape_of

BALL = Sphere(3.5e-3)
HALF_WIDTH = shape_of("digit").half_width
FRICTION = 0.5
ENDS_AT_MU = "the force along the slide ends at 0.5 of the normal one, to the dome's slope of 0.05; Coulomb's law holds"


@case("slide_{}_fast", "sliding and rolling", MECHANICS_FAST, ENDS_AT_MU, ("digit",), ("biotac",), slow=["biotac"])
def test_slide_fast(sensor: str) -> Found:
    """0.3 mm deep, then 1.2 mm along the finger: friction grows to the coefficient, and stays."""
    one = press(sensor, BALL, MIDDLE, FRICTION)
    found = one.at_depth(0.3e-3)
    for way in np.linspace(0.1e-3, 1.2e-3, 8):
        found = one.at_depth(0.3e-3, one.pose.slid(way, 0.0))
    normal, along = found.force @ one.pose.direction, found.force @ one.pose.axes[:, 0]
    words = f"{found.linear.slipping.mean():.0%} of the touching nodes slip"
    return Found(along / normal - FRICTION, "of force", 0.06, words=words, broken=broken_fast(found, BALL, FRICTION))


@case("slide_{}_full", "sliding and rolling", MECHANICS_FULL, ENDS_AT_MU, ("digit",), slow=["digit"])
def test_slide_full(sensor: str) -> Found:
    """The same in the full tier, 0.6 mm far."""
    steps = [Step(depth=0.3e-3), *(Step(depth=0.3e-3, slide=(way, 0.0)) for way in (0.2e-3, 0.4e-3, 0.6e-3))]
    found = list(solve_path(sensor, BALL, MIDDLE, steps, "full", FRICTION))[-1]
    pose = pose_at(sensor, BALL, MIDDLE)
    ratio = (found.force @ pose.axes[:, 0]) / (found.force @ pose.direction)
    broken = broken_full(found, sensor, BALL, pose.slid(0.6e-3, 0).moved(0.3e-3), FRICTION)
    return Found(ratio - FRICTION, "of force", 0.06, words=f"{found.slipping:.0%} slip", broken=broken)


@case("roll_digit_fast", "sliding and rolling", MECHANICS_FAST,
      "without friction a rolled contact is a fresh press at its place, to twice the gaps' tolerance")  # fmt: skip
def test_rolled() -> Found:
    """The indenter goes 2 mm across the gel at one depth from its own first touch, in steps, and is then compared."""
    way = np.linspace(0, 2e-3, 9)
    one = press("digit", BALL, MIDDLE, 0.0)
    for x in way:
        found = one.at_depth(0.4e-3, one.pose.slid(x, 0.0))
    fresh = press("digit", BALL, MIDDLE, 0.0)
    at_once = fresh.at_depth(0.4e-3, fresh.pose.slid(way[-1], 0.0))
    off = np.abs(found.corrected.displacement - at_once.corrected.displacement).max()
    return Found(off * 1e6, "um", 0.4, broken=broken_fast(found, BALL, 0.0))


@case("off_the_rim_{:g}_fast", "contact at the pad's rim and leaving it", MECHANICS_FAST,
      "forces stay balanced and in Coulomb's cone; beyond the gel there is none, and nothing stays deformed",
      (0.0,), (0.5,))  # fmt: skip
def test_off_the_rim(friction: float) -> Found:
    """From 2 mm inside the gel's side outward, past its outline, until nothing touches."""
    place = Placement(-8e-3, HALF_WIDTH - 2e-3)
    one = press("digit", BALL, place, friction)
    out = float(np.sign(one.pose.axes[:, 1] @ [0, 0, 1]))
    found, forces, broken = one.at_depth(0.4e-3), [], []
    for way in np.linspace(0, 8e-3, 17):
        found = one.at_depth(0.4e-3, one.pose.slid(0.0, out * way))
        forces.append(float(np.linalg.norm(found.force)))
        broken += [f"{word}, {way * 1e3:.1f} mm out" for word in broken_fast(found, BALL, friction)]
    words = "N: " + " ".join(f"{force:.3g}" for force in forces[::2])
    last = float(np.abs(found.corrected.displacement).max())
    if last > 1e-6:
        broken.append(f"the gel is left {last * 1e6:.1f} um deformed")
    return Found(forces[-1], "N", 0.0, words=words, broken=tuple(broken))


@case("lifted_full", "contact at the pad's rim and leaving it", MECHANICS_FULL,
      "a path that ends above the gel ends without force, the gel at rest to 0.01 um")  # fmt: skip
def test_lifted() -> Found:
    """0.3 mm deep at the rim, then back to first touch."""
    place = Placement(-8e-3, HALF_WIDTH - 0.6e-3)
    found = list(solve_path("digit", BALL, place, [Step(depth=0.3e-3), Step(depth=0.0)], "full", 0.0))[-1]
    broken = () if not found.force.any() else (f"{np.linalg.norm(found.force):.2g} N are left",)
    return Found(float(np.abs(found.displacement).max()) * 1e6, "um", 0.01, broken=broken)


@case("off_the_gel", "contact at the pad's rim and leaving it", MECHANICS_FAST,
      "a press beside the gel is refused, in words")  # fmt: skip
def test_beside() -> Found:
    """1 mm outside the outline."""
    place = Placement(-8e-3, HALF_WIDTH + 1e-3)
    return refusal(lambda: next(solve_path("digit", BALL, place, [Step(depth=0.1e-3)])), "on the DIGIT's gel")
