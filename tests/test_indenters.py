"""Every indenter: exact distance, unit gradient, support, touching pose."""

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.indenters import Cylinder, Sphere, pose_on

INDENTERS = [Sphere(3.5e-3), Cylinder(3e-3, 0.5e-3), Cylinder(1e-3, 0.9e-3, 4e-3)]


@pytest.mark.parametrize("indenter", INDENTERS, ids=str)
def test_gradient_is_that_of_the_distance(indenter):
    points = np.random.default_rng(0).uniform(-8e-3, 8e-3, (500, 3))
    _, gradient = indenter.distance(points)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, rtol=1e-9)
    step = 1e-8
    numeric = np.stack(
        [
            (indenter.distance(points + step * axis)[0] - indenter.distance(points - step * axis)[0]) / (2 * step)
            for axis in np.eye(3)
        ],
        -1,
    )
    near_crease = np.abs(numeric - gradient).max(axis=1) > 1e-4
    assert near_crease.mean() < 0.02  # inside a cylinder the nearest face changes on a thin set


@pytest.mark.parametrize("indenter", INDENTERS, ids=str)
def test_distance_is_exact_outside(indenter):
    """A point at distance d along the gradient of a surface point has distance d."""
    random = np.random.default_rng(1)
    directions = random.standard_normal((200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    surface = np.array([indenter.support(d) for d in directions])
    distance, _ = indenter.distance(surface + 2e-3 * directions)
    np.testing.assert_allclose(distance, 2e-3, atol=1e-12)
    np.testing.assert_allclose(indenter.distance(surface)[0], 0, atol=1e-12)


@pytest.mark.parametrize("indenter", INDENTERS, ids=str)
@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_pose_just_touches(indenter, tilt):
    outward = np.array([0.2, -1.0, 0.3]) / np.linalg.norm([0.2, -1.0, 0.3])
    point = np.array([-5e-3, -7e-3, 1e-3])
    pose = pose_on(indenter, point, outward, tilt, 2.0)
    np.testing.assert_allclose(pose.axes.T @ pose.axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose.axes) == pytest.approx(1)
    assert np.arccos(np.clip(-pose.direction @ outward, -1, 1)) == pytest.approx(tilt, abs=1e-7)
    plane = point + np.random.default_rng(2).uniform(-5e-3, 5e-3, (2000, 3)) @ (np.eye(3) - np.outer(outward, outward))
    assert pose.distance(indenter, plane)[0].min() > -1e-9
    assert pose.distance(indenter, point[None])[0][0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Sphere(0.0),
        lambda: Sphere(float("nan")),
        lambda: Sphere(3.5),
        lambda: Cylinder(3e-3, 3e-3),
        lambda: Cylinder(3e-3, -1e-3),
    ],
)
def test_impossible_indenters_are_refused(make):
    with pytest.raises(TactileError):
        make()
