"""The print of a ball: a sphere inside, a smooth shoulder outside, on a dome too."""

import numpy as np
import pytest

from tactile_core.pictures.calibrate.ball_print import deepest, print_on

RIGHT, DOWN = np.meshgrid(np.linspace(-6e-3, 6e-3, 241), np.linspace(-6e-3, 6e-3, 241))
FLAT = np.zeros(RIGHT.shape)


def sphere(depth: float, radius: float, right: float = 0.0, down: float = 0.0) -> np.ndarray:
    square = (RIGHT - right) ** 2 + (DOWN - down) ** 2
    return depth - radius + np.sqrt(np.maximum(radius**2 - square, 0))


@pytest.mark.parametrize("depth", [0.2e-3, 0.8e-3, 1.5e-3])
@pytest.mark.parametrize("radius", [2.2e-3, 3e-3])
def test_the_gel_lies_on_the_ball_inside_and_clear_of_it_outside(depth: float, radius: float) -> None:
    gel = print_on(FLAT, RIGHT, DOWN, (0.0, 0.0, depth, radius))
    distance = np.hypot(RIGHT, DOWN)
    inside = distance < 0.6 * np.sqrt(2 * radius * depth)
    # The table is linear between depths: 2 um of what the ball's profile differs from a parabola.
    np.testing.assert_allclose(gel[inside], sphere(depth, radius)[inside], atol=2.5e-6)
    assert (gel - sphere(depth, radius))[distance < radius].min() > -2.5e-6  # no gel inside the ball
    assert gel.max() == pytest.approx(depth, abs=1e-6)


def test_the_shoulder_stands_over_the_undeformed_gel_and_fades() -> None:
    gel = print_on(FLAT, RIGHT, DOWN, (0.0, 0.0, 1e-3, 3e-3))
    row = gel[120, 120:]
    edge = int(np.searchsorted(RIGHT[120, 120:], 2.0e-3))  # just outside the contact
    assert row[edge] > 0.2e-3
    assert (np.diff(row[:60]) < 1e-7).all()  # falls from the middle outward
    assert np.abs(row[-10:]).max() < 0.03e-3  # the bulge of a layer that keeps its volume is a few hundredths of a mm


def test_a_dome_is_pressed_onto_the_sphere_too() -> None:
    dome = RIGHT**2 / (2 * 21e-3)
    place = (2e-3, -1e-3, 0.9e-3, 3e-3)
    gel = print_on(dome, RIGHT, DOWN, place)
    near = np.hypot(RIGHT - 2e-3, DOWN + 1e-3) < 1.1e-3
    ball = sphere(0.0, 3e-3, 2e-3, -1e-3)
    lift = (gel - ball)[near]
    assert np.ptp(lift) < 5e-6  # on one sphere
    # Depth counts from first touch, which is where the gap is least.
    first = (ball - dome)[np.hypot(RIGHT - 2e-3, DOWN + 1e-3) < 2.5e-3].max()
    assert lift.mean() + first == pytest.approx(0.9e-3, abs=5e-6)


def test_prints_change_smoothly_with_depth() -> None:
    depths = np.linspace(0.1e-3, 2.1e-3, 81)
    heights = np.array([print_on(FLAT, RIGHT, DOWN, (0.0, 0.0, depth, 3e-3))[120, 160] for depth in depths])
    assert (np.diff(heights) > 0).all()  # 2 mm aside: deeper is higher
    assert np.abs(np.diff(heights, 2)).max() < 8e-6  # kinks of a table that is linear between depths


@pytest.mark.parametrize("radius", [0.5e-3, 0.75e-3, 1.2e-3])
@pytest.mark.parametrize("share", [0.3, 0.8])
def test_small_balls_have_prints_of_their_own(radius: float, share: float) -> None:
    depth = share * deepest(radius)
    gel = print_on(FLAT, RIGHT, DOWN, (0.0, 0.0, depth, radius))
    distance = np.hypot(RIGHT, DOWN)
    inside = distance < 0.4 * np.sqrt(2 * radius * depth)
    np.testing.assert_allclose(gel[inside], sphere(depth, radius)[inside], atol=5e-6)
    scaled = print_on(FLAT, RIGHT, DOWN, (0.0, 0.0, depth, radius), thickness=1.35 * radius)  # as under a 6 mm ball
    beside = np.abs(distance - 2.2 * np.sqrt(radius * depth)) < 0.1 * radius
    assert (gel[beside] > scaled[beside]).all()  # in the thicker layer the shoulder reaches farther


def test_a_print_changes_smoothly_with_the_ball_s_size() -> None:
    radii = np.linspace(0.4e-3, 4e-3, 73)
    heights = np.array([print_on(FLAT, RIGHT, DOWN, (0.0, 0.0, 0.25e-3, radius))[120, 160] for radius in radii])
    assert np.abs(np.diff(heights)).max() < 4e-6  # 2 mm aside, at one depth
