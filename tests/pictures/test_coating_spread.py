"""Light that goes sideways in the coating: against a Gaussian, and what must stay as it is."""

import dataclasses

import numpy as np
import pytest
from gel_pictures import Press, works
from plain_unit import plain_unit

from tactile_core.pictures import coating_spread
from tactile_core.pictures.coating_spread import CoatingSpread
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.mitsuba.variant import LLVM
from tactile_core.pictures.renderer import Renderer


@pytest.mark.parametrize("size", [(60, 80), (240, 320), (480, 640)])
def test_a_soft_edge_is_evened_out_as_by_a_gaussian(size):
    """A ramp of a Gaussian's integral of width s becomes one of sqrt(s^2 + spread^2)."""
    from scipy.special import ndtr

    camera, wide = plain_unit().at_size(*size).camera, 0.3e-3
    ramp = np.broadcast_to(100 * ndtr(camera.right / wide), (3, *camera.shape)).astype(np.float32)
    found = CoatingSpread(camera, 0.4e-3)(ramp)
    expected = np.broadcast_to(100 * ndtr(camera.right / 0.5e-3), ramp.shape)
    inside = np.abs(camera.right) < 3e-3  # at the picture's edge there is nothing beyond
    np.testing.assert_allclose(found[..., inside], expected[..., inside], atol=0.15)  # measured 0.05 to 0.1 levels


def test_blocks_of_weights_give_what_all_weights_give(monkeypatch):
    light = np.random.default_rng(2).uniform(0, 255, (3, *plain_unit().camera.shape)).astype(np.float32)
    found = CoatingSpread(plain_unit().camera, 0.4e-3)(light)
    monkeypatch.setattr(coating_spread, "BLOCK", 10_000)
    whole = CoatingSpread(plain_unit().camera, 0.4e-3)(light)
    np.testing.assert_allclose(found, whole, atol=2e-4)  # levels of 255, float32's rounding of a sum


def test_even_light_and_no_spread_change_nothing():
    plain = plain_unit()
    light = np.full((3, *plain.camera.shape), 70.0, np.float32)
    np.testing.assert_allclose(CoatingSpread(plain.camera, 0.4e-3)(light), light, rtol=1e-5)
    assert CoatingSpread(plain.camera, 0.0)(light) is light


@pytest.mark.parametrize("preset", ["fast", "standard"])
def test_a_coating_that_spreads_light_softens_the_rim_and_leaves_rest_alone(preset):
    if preset != "fast":
        works(LLVM)
    plain = plain_unit()
    softer = dataclasses.replace(plain, coating=dataclasses.replace(plain.coating, spread=0.3e-3))
    rest, height = rest_height_map(plain.camera), Press(depth=1e-3).on(plain.camera)
    pictures = [Renderer(unit, preset)(height).astype(float) for unit in (plain, softer)]
    steepest = [np.abs(np.diff(picture, axis=1)).max() for picture in pictures]
    assert steepest[1] < 0.6 * steepest[0]
    renderer = Renderer(softer, preset)
    np.testing.assert_array_equal(renderer(rest), np.rint(renderer.background).clip(0, 255))
