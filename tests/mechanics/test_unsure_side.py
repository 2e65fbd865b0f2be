"""What the fast tier says of a sharp indenter whose nodes lie on one of its faces."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import Edge, Sphere
from tactile_core.mechanics.error_estimate import expected_error
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import solve

MIDDLE = Placement(-8.2e-3, 1.13e-3)


def test_a_wedge_that_leans_on_one_face_says_that_the_skin_may_lie_aside():
    """73 um : rms off the full tier; the skin lies 62 um aside of it as a whole."""
    found = solve("biotac", Edge(np.radians(60), 0.4e-3), MIDDLE, depth=0.3e-3, friction=0.0)
    assert 73e-6 < found.shape_error < 110e-6


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_a_blunt_indenter_states_the_error_of_its_depth(sensor):
    found = solve(sensor, Sphere(2e-3), Placement(-8.2e-3, 1.13e-3, 0.3), depth=0.3e-3, friction=0.0)
    assert found.shape_error == expected_error("fast", sensor, found.depth / found.thickness)[0]
