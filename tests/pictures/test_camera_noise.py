"""The camera's noise in a picture: as large as the unit's, and of its grain, by every preset."""

import numpy as np
import pytest
from plain_unit import plain_unit

from tactile_core.pictures.renderer import Renderer, camera_noise

NOISE = (1.0, 2.0, 4.0)
MEASURED = 0.74, 0.49, 0.25  # correlation over 1, 2 and 3 px on real pictures (docs/sources.md, DIGIT camera)


def correlation(noise, step):
    return float((noise[:, step:] * noise[:, :-step]).mean() / noise.var())


def test_noise_has_the_unit_s_size_and_grain():
    unit = plain_unit(noise=NOISE)
    noise = camera_noise(unit, np.random.default_rng(3))
    assert noise.shape == (*unit.camera.shape, 3)
    np.testing.assert_allclose(noise.std((0, 1)), NOISE, rtol=0.05)  # 4,800 independent squares: 1 %
    for step, said in enumerate(MEASURED, 1):
        for values in (noise[..., 2], noise[..., 2].T):
            assert correlation(values, step) == pytest.approx(said, abs=0.05)
    channels = np.corrcoef(noise.reshape(-1, 3).T)
    assert np.abs(channels - np.eye(3)).max() < 0.06  # each channel has its own


@pytest.mark.parametrize("preset", ["fast", "standard"])
def test_every_preset_has_the_same_noise_and_none_unasked(preset):
    if preset != "fast":
        pytest.importorskip("mitsuba")
    unit = plain_unit(noise=NOISE)
    flat, grey = np.zeros(unit.camera.shape), np.full((*unit.camera.shape, 3), 128)
    renderer = Renderer(unit, preset, background=grey, rest=flat)
    one, again = (renderer.picture(renderer.rest_radiance, np.random.default_rng(7)).astype(float) for _ in range(2))
    np.testing.assert_array_equal(one, again)
    # Whole levels add a variance of 1/12.
    np.testing.assert_allclose((one - 128).std((0, 1)), np.sqrt(np.square(NOISE) + 1 / 12), rtol=0.05)
    assert correlation(one[..., 2] - one[..., 2].mean(), 1) == pytest.approx(MEASURED[0], abs=0.05)
    np.testing.assert_array_equal(renderer(flat), grey)
