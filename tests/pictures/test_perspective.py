"""What a pinhole camera sees of a height map: against geometry, and where the gel hides a part of itself."""

import dataclasses

import numpy as np
import pytest
from plain_unit import plain_unit

from tactile_core.errors import TactileError
from tactile_core.pictures.perspective import Perspective, bilinear

CAMERA = plain_unit().camera
RIGHT, DOWN = (values.astype(np.float32) for values in np.meshgrid(CAMERA.right, CAMERA.down))
DOME = (RIGHT**2 / 42e-3).astype(np.float32)


def ball(depth: float, right: float, down: float) -> np.ndarray:
    """The dome with the smoothed print of a 6 mm ball."""
    excess = (depth - ((RIGHT - right) ** 2 + (DOWN - down) ** 2) / 6e-3) / 40e-6
    return (DOME + 40e-6 * np.logaddexp(0, excess)).astype(np.float32)


def test_a_level_plane_is_seen_level() -> None:
    plane = np.full(CAMERA.shape, 1e-3, np.float32)
    np.testing.assert_allclose(Perspective(CAMERA, DOME)(plane), plane, atol=1e-9)


@pytest.mark.parametrize(("depth", "right", "down"), [(0.5e-3, 0, 0), (1.5e-3, 3e-3, -4e-3), (1.2e-3, -4e-3, 6e-3)])
def test_what_is_seen_lies_on_the_gel_and_on_the_pixel_s_ray(depth: float, right: float, down: float) -> None:
    gel = ball(depth, right, down)
    seen = Perspective(CAMERA, DOME)(gel)
    near = 1 - seen / CAMERA.apparent_height
    row = (DOWN * near - CAMERA.down[0]) / CAMERA.pixel_size[1]
    column = (RIGHT * near - CAMERA.right[0]) / CAMERA.pixel_size[0]
    miss = np.abs(bilinear(gel, row, column) - seen)
    assert miss.max() < 3e-6  # m; measured: 2 um in single pixels of the sharp edge
    assert np.sqrt(np.mean(miss**2)) < 0.1e-6


def test_search_from_above_agrees() -> None:
    gel = ball(1.2e-3, 2e-3, 3e-3)
    view = Perspective(CAMERA, DOME)
    np.testing.assert_allclose(view(gel), view._from_above(gel), atol=3e-6)


def test_the_same_gel_is_seen_bit_by_bit_alike() -> None:
    view = Perspective(CAMERA, DOME)
    np.testing.assert_array_equal(view(DOME), view(DOME.copy()))


def test_of_gel_that_hides_gel_the_nearer_is_seen() -> None:
    # A wall of 1 mm toward the outside, steeper than the camera's rays 5 mm off the middle (1 in 4).
    wall = (1e-3 / (1 + np.exp(np.clip((RIGHT - 4e-3) / 20e-6, -60, 60)))).astype(np.float32)
    seen = Perspective(CAMERA, np.zeros_like(DOME))(wall)
    middle = seen[CAMERA.height // 2]
    # The top's edge at 4 mm is seen at 4 / (1 - 1 / 20) mm; what the ground shows inside of that is hidden.
    edge = 4e-3 / (1 - 1e-3 / CAMERA.apparent_height)
    off = CAMERA.right - edge
    assert (middle[off < -0.15e-3] > 0.9e-3).all()
    assert (middle[off > 0.15e-3] < 0.1e-3).all()


def test_gel_that_reaches_the_camera_is_refused() -> None:
    with pytest.raises(TactileError, match="below the camera"):
        Perspective(CAMERA, DOME)(np.full(CAMERA.shape, 19e-3, np.float32))


def test_far_camera_sees_the_map_itself() -> None:
    far = dataclasses.replace(CAMERA, apparent_height=100.0)
    gel = ball(1e-3, 1e-3, 1e-3)
    # slopes of 0.8 times 8 mm / 100 m of height
    np.testing.assert_allclose(Perspective(far, DOME)(gel), gel, atol=0.5e-6)
