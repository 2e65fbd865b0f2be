"""Points that stand for a light."""

import numpy as np
import pytest

from tactile_core.pictures.mitsuba.matte_light import light_points, sphere_points
from tactile_core.sensors.camera import Led

LED = Led("green", (-13.3e-3, -8.5e-3, 7.6e-3), 1.0e-3, 1.0)


@pytest.mark.parametrize("count", [3, 4, 5, 6, 8])
def test_a_ring_has_the_moments_of_an_even_disc(count):
    seeds = (light_points(LED, count) - LED.position) / LED.radius
    toward = np.array(LED.position) / np.linalg.norm(LED.position)
    np.testing.assert_allclose(seeds.mean(0), 0, atol=1e-12)
    np.testing.assert_allclose(seeds @ toward, 0, atol=1e-12)
    disc = (np.eye(3) - np.outer(toward, toward)) / 4  # of x and y over a disc of radius 1: 1/4 each
    np.testing.assert_allclose(seeds.T @ seeds / count, disc, atol=1e-12)


def test_a_cloud_looks_like_an_even_disc_from_every_side():
    random = np.random.default_rng(3)
    cloud = np.concatenate([sphere_points(LED, 8, *random.random(2)) for _ in range(2000)])
    seeds = (cloud - LED.position) / LED.radius
    assert np.linalg.norm(seeds, axis=1).max() <= 1
    for _ in range(5):
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        seen = np.linalg.norm(seeds - np.outer(seeds @ axis, axis), axis=1)
        shares = np.histogram(seen**2, bins=8, range=(0, 1))[0] / len(seen)
        np.testing.assert_allclose(shares, 1 / 8, atol=0.012)  # rings of equal area; 16,000 points: 0.0026 each, sd


def test_a_cloud_lights_as_its_middle_does():
    """Newton's shell theorem: the mean of l / |l|^3 over the cloud is that of its middle."""
    random = np.random.default_rng(4)
    cloud = np.concatenate([sphere_points(LED, 8, *random.random(2)) for _ in range(4000)])
    place = np.array([-5e-3, -6e-3, 1e-3])
    field = ((cloud - place) / np.linalg.norm(cloud - place, axis=1, keepdims=True) ** 3).mean(0)
    middle = (np.array(LED.position) - place) / np.linalg.norm(np.array(LED.position) - place) ** 3
    np.testing.assert_allclose(field, middle, rtol=2e-3)  # 32,000 points of 10 % spread
