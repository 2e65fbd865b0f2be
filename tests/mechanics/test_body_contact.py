"""The roundness and the lean of a pressed body are read off the surface under it."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.placement import Placement

pytest.importorskip("scipy", reason="contacts are solved with scipy, of the extra [fem]")
from tactile_core.mechanics import body_contact
from tactile_core.mechanics.solve import solve

DOWN = np.array([0.0, -1.0, 0.0])  # outward on the gel


def test_a_press_leans_as_the_deepest_node_moves():
    pressed = solve("digit", Sphere(5e-3), Placement(-8e-3, 0.0, 0.3, 0.5), force=1.0)
    motion = pressed.displacement[np.argmax(pressed.displacement[:, 1])]
    found = body_contact.leaning(-8e-3, 0.0, motion, DOWN)
    # The node lies up to half a spacing beside first touch, where the gel's normal is not straight down.
    assert found.tilt == pytest.approx(0.3, abs=0.05) and found.tilt_heading == pytest.approx(0.5, abs=0.15)
    assert body_contact.leaning(-8e-3, 0.0, np.array([5.0, 0.1, 0.0]), DOWN).tilt == body_contact.LARGEST_TILT


def test_the_radius_of_a_ball_is_read_off_its_dent():
    pressed = solve("digit", Sphere(5e-3), Placement(-8e-3, 1e-3), force=1.0)
    points = (sensors.digit_surface().rest + pressed.displacement)[pressed.contact_patch]
    # Nodes between those in contact are off the ball, and the dent is a cap where the fit is a paraboloid: 15 %.
    assert body_contact.patch_radius(points, DOWN) == pytest.approx(5e-3, rel=0.15)


def test_flat_and_small_patches_take_radii_that_the_networks_know():
    level = sensors.digit_surface().rest * [1, 0, 1]  # all nodes in one plane
    assert body_contact.patch_radius(level[:4], DOWN) == body_contact.USUAL_RADIUS
    assert body_contact.patch_radius(level, DOWN) == body_contact.RADII[1]
