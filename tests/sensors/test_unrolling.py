"""Unrolling: what rolls off the pad rolls back on."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.mechanics.node_areas import node_areas
from tactile_core.sensors import unrolling


@pytest.mark.parametrize("point", [(-8e-3, 0.0), (-8e-3, 5e-3), (-15e-3, -3e-3), (-19e-3, 2e-3), (3e-3, -6e-3)])
def test_roll_up_inverts_unrolling(point):
    position, normal = unrolling.roll_up(np.array(point))
    assert np.linalg.norm(normal) == pytest.approx(1)
    rolled = unrolling.unrolled_nodes()
    known = np.isfinite(rolled[:, 0])
    near = np.argsort(np.linalg.norm(sensors.biotac_surface().rest[known] - position, axis=1))[:4]
    # the four nodes around it unroll to within one node spacing (0.6 mm) of the point
    assert np.linalg.norm(rolled[known][near] - point, axis=1).max() < 0.9e-3


def test_the_middle_of_the_pad_shares_x_and_the_side_unrolls_to_the_arc():
    position, _ = unrolling.roll_up(np.array([-8e-3, 0.0]))
    np.testing.assert_allclose(position[[0, 2]], [-8e-3, 0.0], atol=1e-6)
    position, normal = unrolling.roll_up(np.array([-8e-3, 5e-3]))
    angle = np.arctan2(position[2], -(position[1] + 1.237e-3))
    assert angle == pytest.approx(5e-3 / 7.065e-3, abs=1e-3)
    assert normal[2] > 0.6


def test_toward_the_tip_the_profile_is_longer_than_its_shadow():
    rolled, rest = unrolling.unrolled_nodes(), sensors.biotac_surface().rest
    lowest = np.flatnonzero((np.abs(rolled[:, 1]) < 1e-9) & (rest[:, 0] < -18e-3))
    assert (rolled[lowest, 0] < rest[lowest, 0]).all()


def test_closest_point_agrees_with_trimesh():
    trimesh = pytest.importorskip("trimesh", reason="trimesh, the oracle, is not installed")
    pytest.importorskip("rtree", reason="trimesh's search needs rtree")
    gel = sensors.digit_surface()
    points = np.random.default_rng(0).uniform([-22e-3, -10e-3, -10e-3], [6e-3, -3e-3, 10e-3], (40, 3))
    _, weights, place = unrolling.closest_on_triangles(gel, points)
    oracle, _, _ = trimesh.proximity.closest_point(
        trimesh.Trimesh(gel.rest * 1e3, gel.faces, process=False), points * 1e3
    )
    distance = np.linalg.norm(place - points, axis=1)
    np.testing.assert_allclose(distance, np.linalg.norm(oracle / 1e3 - points, axis=1), atol=1e-9)
    np.testing.assert_allclose(weights.sum(axis=1), 1)


def test_areas_and_normals_of_a_known_surface():
    gel = sensors.digit_surface()
    normals = unrolling.node_normals(gel.rest, gel.faces)
    shadow = node_areas("digit") @ -normals[:, 1]
    # outline: 18.34 mm wide, half a disc at one end, two rounded corners at the other
    plan = 15.83e-3 * 18.34e-3 + np.pi * 9.17e-3**2 / 2 - (2 - np.pi / 2) * 1.15e-3**2
    assert shadow == pytest.approx(plan, rel=0.01)  # arcs cut by chords of 1 mm
