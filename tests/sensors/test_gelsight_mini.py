"""The GelSight Mini by its descriptor: the public mesh's nodes, and its picture inside the even window."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.sensors.about import about
from tactile_core.sensors.calibration_file import load_calibration

NAME = "gelsight_mini"
# Nodes of the public mesh (docs/sources.md, GelSight Mini gel): mm from its middle, along the short and the long side,
# and height over the back.
APEX, DOME = (0.0, 0.0, 4.0), [(4.5, 6.0, 3.8395), (7.5354, 0.0, 3.75), (7.5354, 9.7165, 3.6760), (0.0, 3.0, 3.9764)]
EDGE = [(8.7336, 0.0, 3.5379), (9.3083, 0.0, 3.3350), (0.0, 11.125, 3.4625)]


@pytest.mark.parametrize(("nodes", "within"), [([APEX], 1e-7), (DOME, 3e-6), (EDGE, 40e-6)])
def test_the_surface_passes_through_nodes_of_the_public_mesh(nodes, within):
    x, z, height = 1e-3 * np.array(nodes).T
    for side in (-1, 1):
        found = sensors.shape_of(NAME).dome_height(-8e-3 + side * x, side * z)
        np.testing.assert_allclose(found, height, atol=within)


def test_its_lowest_point_is_the_biotac_s():
    lowest = sensors.sensor_surface(NAME).rest[:, 1].min()
    assert lowest == pytest.approx(load_calibration(None, NAME).camera.height_zero_y, abs=2e-6)
    assert lowest == pytest.approx(sensors.biotac_surface().rest[:, 1].min(), abs=10e-6)


def test_the_window_is_even_and_holds_the_picture():
    surface, camera = sensors.sensor_surface(NAME), load_calibration(None, NAME).camera
    rest = surface.grid(surface.rest)[surface.window]
    steps = np.diff(rest[:, 0, 0]), np.diff(rest[0, :, 2])
    assert all(np.ptp(each) < 1e-9 and each[0] <= 0.35e-3 for each in steps)
    for seen, nodes in ((camera.gel_x, rest[:, 0, 0]), (camera.gel_z, rest[0, :, 2])):
        assert nodes.min() <= seen.min() and seen.max() <= nodes.max()


def test_a_sensor_is_told_in_words():
    words = about(NAME)
    assert "gelsight_mini: GelSight Mini\nkind: gel, domed, 4 mm thick" in words and "source: FEATS" in words
    assert "kind: fluid, a skin 1.58 mm thick" in about("biotac")
    with pytest.raises(TactileError, match="expected biotac, biotac_sp, digit, gelsight_mini"):
        about("gelsight")
