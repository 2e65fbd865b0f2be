"""Nodes in a concave crease stand once for each of its faces."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import BumpyCube, Pose, Ring
from tactile_core.mechanics.fast.contact_state import Candidates

BUMPY = BumpyCube(14e-3, 0.5e-3, 1.5e-3, 1e-3, 4e-3)
HERE = Pose(np.zeros(3), np.eye(3))


def surface_point_below(indenter, point):
    """A point of the indenter's surface below ``point`` (3,), and the normal there."""
    gap, normal = indenter.distance(point[None])
    return point - gap[0] * normal[0], normal[0]


def one(point):
    return Candidates(
        np.array([7]), point[None], np.zeros((1, 3)), np.ones(1, bool), np.empty(0, int), np.zeros(1, int)
    )


@pytest.mark.parametrize("away", [0.05e-3, 0.2e-3, 0.4e-3])  # m, of the two looks from the rim where the faces meet
def test_a_node_at_the_foot_of_a_bump_touches_bump_and_face(away):
    foot = np.sqrt(1e-3 * (2 * 1.5e-3 - 1e-3))
    rim = np.array([foot, 0.0, 1e-3])
    up_the_side = np.radians(20) + away / 1.5e-3  # from the ball's equator, below it
    side = np.array([1.5e-3 * np.cos(up_the_side), 0.0, 1.5e-3 * (1 - np.sin(up_the_side))])
    left, normal = surface_point_below(BUMPY, rim + np.array([away, 0.0, 0.05e-3]))
    candidates = one(side)
    candidates.split(np.array([0]), left[None], normal[None], BUMPY, HERE, np.zeros((1, 3)))
    assert candidates.nodes.tolist() == [7, 7]
    assert candidates.faced.all()
    np.testing.assert_allclose(candidates.displacement[0], rim, atol=0.6 * away)  # planes for a round side
    normals = BUMPY.distance(candidates.displacement + candidates.probe)[1]
    assert sorted(np.round(normals[:, 2], 2)) == pytest.approx([-1.0, -np.sin(np.radians(20))], abs=0.2)


def test_a_smooth_surface_has_no_crease():
    ring = Ring(2.5e-3, 1e-3)
    left, normal = surface_point_below(ring, np.array([3.4e-3, 0.0, 0.9e-3]))
    candidates = one(np.array([1.7e-3, 0.0, 0.6e-3]))
    for _ in range(3):
        assert not candidates.faced.any()
        candidates.split(np.array([0]), left[None], normal[None], ring, HERE, np.zeros((1, 3)))
    assert candidates.nodes.tolist() == [7]
    assert candidates.faced.all()  # enough looks
