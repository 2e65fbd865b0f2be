"""A press is found again in the skin that it deformed, and solved on the gel."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Box, Sphere
from tactile_core.mechanics.placement import Placement

pytest.importorskip("scipy", reason="contacts are solved with scipy, of the extra [fem]")
from tactile_core.mechanics.skin_contact import likely_contacts, skin_contact
from tactile_core.mechanics.solve import solve

CUBE = Box((14e-3, 14e-3, 14e-3), 0.5e-3)


@pytest.mark.parametrize("place", [Placement(-8e-3, 1e-3), Placement(-15e-3, -2e-3, 0.3, 1.0)], ids=["middle", "tip"])
def test_a_press_is_found_in_the_skin(place):
    pressed = solve("biotac", Sphere(5e-3), place, force=1.0)
    found = skin_contact(pressed.displacement)
    # On 32 presses (four places, .4 and 1.5 N, 2 to 8 mm), median and most: place .02 and .11 mm, force 1 and 20 %,
    # lean .01 and .04 rad, the gel 4 and 22 %.
    assert np.hypot(found.place.x - place.x, found.place.z - place.z) < 0.2e-3
    assert found.force == pytest.approx(1.0, rel=0.08)
    assert found.place.tilt == pytest.approx(place.tilt, abs=0.05)
    gel, true = found.on_gel().displacement, solve("digit", Sphere(5e-3), place, force=1.0).displacement
    assert np.linalg.norm(gel - true) < 0.15 * np.linalg.norm(true)


def test_the_body_pressed_is_told_from_others():
    place = Placement(-8e-3, 0.0, 0.2, 0.5)
    pressed = solve("biotac", CUBE, place, force=1.0)
    contacts = likely_contacts(pressed.displacement, [Sphere(1.75e-3), CUBE, Sphere(7e-3)])
    assert contacts[0].body is CUBE and len(contacts) == 4  # those three and a ball
    gel, true = contacts[0].on_gel().displacement, solve("digit", CUBE, place, force=1.0).displacement
    ball = skin_contact(pressed.displacement).on_gel().displacement
    assert np.linalg.norm(gel - true) < 0.5 * np.linalg.norm(ball - true)


def test_a_skin_at_rest_is_refused_in_words():
    with pytest.raises(TactileError, match="no pressed node"):
        skin_contact(np.zeros_like(sensors.biotac_surface().rest))


def test_a_dent_deeper_than_any_body_goes_is_refused_in_words():
    pressed = solve("biotac", Sphere(5e-3), Placement(-8e-3, 0.0), force=1.0)
    with pytest.raises(TactileError, match="dent of 5"):
        skin_contact(pressed.displacement * (5e-3 / np.linalg.norm(pressed.displacement, axis=1).max()))
