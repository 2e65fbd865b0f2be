"""Light that drifts between photographs: said apart from presses, and no harm to where these are found."""

import numpy as np
import pytest
from PIL import Image
from plain_unit import plain_unit
from pressed_unit import BALL, PLACES, write_photographs

from tactile_core.pictures.calibrate.evaluate import evaluate_unit
from tactile_core.pictures.calibrate.photographs import lighting_drift, read_photographs

DOWN, RIGHT = np.meshgrid(np.linspace(-1, 1, 320), np.linspace(-1, 1, 240), indexing="ij")
# Grey levels, a channel each: more than the 18 that count as a press, over a third of the picture.
DRIFT = np.stack([30 * RIGHT - 5, 12 * DOWN**2 + 8 * RIGHT, -20 * DOWN * RIGHT + 6], axis=-1)


def test_a_quadratic_is_found_beside_a_press():
    press = np.where(((RIGHT - 0.3) ** 2 + DOWN**2 < 0.2)[..., None], (60.0, -50.0, 40.0), 0)  # a sixth of the picture
    noise = np.random.default_rng(0).normal(scale=2, size=DRIFT.shape)
    assert np.abs(lighting_drift(DRIFT + press + noise) - DRIFT).max() < 1.5
    assert np.abs(lighting_drift(noise)).max() < 0.5  # nothing is made of nothing


def test_presses_are_found_under_a_drifted_light(tmp_path):
    folder = write_photographs(tmp_path / "presses", plain_unit(), PLACES[:3])
    for file in sorted(folder.iterdir()):
        picture = np.asarray(Image.open(file)).astype(float) + DRIFT
        Image.fromarray(np.rint(picture).clip(0, 255).astype(np.uint8)).save(file)
    tried = evaluate_unit(plain_unit(), read_photographs(folder, tmp_path / "untouched.png"), BALL, search_radius=False)
    for each, (right, down, depth) in zip(tried, PLACES, strict=False):
        assert each.ball.right == pytest.approx(1e-3 * right, abs=0.15e-3)
        assert each.ball.down == pytest.approx(1e-3 * down, abs=0.15e-3)
        assert each.ball.depth == pytest.approx(1e-3 * depth, abs=0.1e-3)
        assert each.metrics["frame_l1"] < 2.5
