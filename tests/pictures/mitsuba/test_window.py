"""Refraction by gel and acrylic."""

import dataclasses

import numpy as np

from tactile_core.pictures.mitsuba.window import apparent_height, cubic, through_window
from tactile_core.sensors.calibration_file import load_calibration

UNIT = load_calibration()
CAMERA, INDEX = UNIT.camera, UNIT.gel_index


def test_on_the_axis_the_pinhole_appears_where_the_camera_says():
    near = apparent_height(np.array([0.0, 1e-6, 0.5e-3]), CAMERA, INDEX)
    np.testing.assert_allclose(near, CAMERA.apparent_height, rtol=1e-3)


def test_rays_farther_out_obey_snell():
    """Traced forward from a pinhole in air, a ray meets the plane where its pixel looks."""
    window = 4.0645e-3 + 4e-3
    air = (CAMERA.apparent_height - window) / INDEX
    for sine in (0.1, 0.3, 0.5):
        tangents = [s / np.sqrt(1 - s * s) for s in (sine, sine / INDEX)]
        reach = air * tangents[0] + window * tangents[1]
        np.testing.assert_allclose(apparent_height(reach, CAMERA, INDEX), reach / tangents[1], rtol=1e-4)


def test_gel_at_height_zero_looks_as_through_a_pinhole():
    picture = np.random.default_rng(0).random((*CAMERA.shape, 3)).astype(np.float32)
    np.testing.assert_array_equal(through_window(picture, np.zeros(CAMERA.shape), UNIT), picture)


def test_raised_gel_shifts_by_less_than_half_a_pixel():
    right, down = np.meshgrid(CAMERA.right, CAMERA.down)
    picture = np.stack([right / CAMERA.pixel_size[0], down / CAMERA.pixel_size[1]], -1)
    shift = through_window(picture, np.full(CAMERA.shape, 1e-3), UNIT) - picture
    inside = shift[2:-2, 2:-2]
    assert 0.01 < np.abs(inside).max() < 0.5


def test_a_camera_too_near_for_a_window_has_none():
    near = dataclasses.replace(CAMERA, apparent_height=6e-3)
    np.testing.assert_array_equal(apparent_height(np.linspace(0, 8e-3, 5), near, INDEX), 6e-3)


def test_cubic_interpolation_keeps_quadratics():
    row, column = np.meshgrid(np.arange(20.0), np.arange(16.0), indexing="ij")
    field = (0.3 * row**2 - row * column + 2 * column)[..., None]
    at_row, at_column = np.random.default_rng(2).uniform(2, 12, (2, 50))
    expected = 0.3 * at_row**2 - at_row * at_column + 2 * at_column
    np.testing.assert_allclose(cubic(field, at_row, at_column)[:, 0], expected, rtol=1e-5)
