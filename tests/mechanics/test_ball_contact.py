"""A press is found again in the skin that it deformed, and in the gel."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics import ball_contact
from tactile_core.mechanics.placement import Placement

pytest.importorskip("scipy", reason="contacts are solved with scipy, of the extra [fem]")
from tactile_core.mechanics.solve import solve

DOWN = np.array([0.0, -1.0, 0.0])  # outward on the gel


@pytest.mark.parametrize("place", [Placement(-8e-3, 1e-3), Placement(-15e-3, -2e-3, 0.3, 1.0)], ids=["middle", "tip"])
def test_a_press_is_found_in_the_skin(place):
    pressed = solve("biotac", Sphere(5e-3), place, force=1.0)
    found = ball_contact.skin_contact(pressed.displacement)
    # Found on 32 presses at four places: within .17 mm (nodes are .7 mm apart), and leaning within .15 rad, which is
    # what the skin's force leans beside the press; the force as traction misses those of real contacts, 15 %.
    assert np.hypot(found.place.x - place.x, found.place.z - place.z) < 0.25e-3
    assert found.force == pytest.approx(1.0, rel=0.15)
    assert found.place.tilt == pytest.approx(place.tilt, abs=0.2)
    gel, true = found.on_gel().displacement, solve("digit", Sphere(5e-3), place, force=1.0).displacement
    assert np.linalg.norm(gel - true) < 0.35 * np.linalg.norm(true)


def test_a_press_leans_as_its_force_does():
    pressed = solve("biotac", Sphere(5e-3), Placement(-8e-3, 0.0, 0.3, 0.5), force=1.0)
    found = ball_contact.leaning(-8e-3, 0.0, pressed.force)
    assert found.tilt == pytest.approx(0.3, abs=0.15) and found.tilt_heading == pytest.approx(0.5, abs=0.3)
    assert ball_contact.leaning(-8e-3, 0.0, np.array([0, 5.0, 0])).tilt < ball_contact.LARGEST_TILT


def test_the_radius_of_a_ball_is_read_off_its_dent():
    pressed = solve("digit", Sphere(5e-3), Placement(-8e-3, 1e-3), force=1.0)
    points = (sensors.digit_surface().rest + pressed.displacement)[pressed.contact_patch]
    # Nodes between those in contact are off the ball, and the dent is a cap where the fit is a paraboloid: 15 %.
    assert ball_contact.patch_radius(points, DOWN) == pytest.approx(5e-3, rel=0.15)


def test_flat_and_small_patches_take_radii_that_the_networks_know():
    level = sensors.digit_surface().rest * [1, 0, 1]  # all nodes in one plane
    assert ball_contact.patch_radius(level[:4], DOWN) == ball_contact.USUAL_RADIUS
    assert ball_contact.patch_radius(level, DOWN) == ball_contact.RADII[1]


def test_a_skin_at_rest_is_refused_in_words():
    with pytest.raises(TactileError, match="no pressed node"):
        ball_contact.skin_contact(np.zeros_like(sensors.biotac_surface().rest))
