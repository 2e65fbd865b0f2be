"""Light through the coating where the ball touches it: found again, and none where there is none."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from plain_unit import plain_unit
from pressed_unit import BALL, write_photographs

from tactile_core.pictures.calibrate.ball_pictures import FastPictures
from tactile_core.pictures.calibrate.evaluate import evaluate_unit
from tactile_core.pictures.calibrate.photographs import read_photographs
from tactile_core.pictures.calibrate.press_fit import contact_disc

PLACE = (0.5, -0.4, 1.3)  # mm


@pytest.mark.parametrize("through", [(0.0, 0.0, 0.0), (40.0, 30.0, 25.0)])
def test_light_through_the_coating_is_found_again(tmp_path: Path, through) -> None:
    unit = plain_unit()
    folder = write_photographs(tmp_path / "presses", unit, (PLACE,))
    photographs = read_photographs(folder, tmp_path / "untouched.png")
    ball = (*(1e-3 * value for value in PLACE), BALL)
    brighter = contact_disc(FastPictures(unit), ball)[..., None] * np.asarray(through)
    (press,) = photographs.presses
    lit = dataclasses.replace(
        press,
        picture=(press.picture + brighter).clip(0, 255).astype(np.uint8),
        change=(press.change + brighter).astype(np.float32),
    )
    (found,) = evaluate_unit(unit, dataclasses.replace(photographs, presses=(lit,)), BALL, search_radius=False)
    np.testing.assert_allclose(found.through, through, atol=3)  # levels; measured 1
    assert found.metrics["through_l1"] < 2.5
    bright = bool(max(through))
    assert any("through the coating" in flag for flag in found.flags) == bright
    assert (found.metrics["roi_l1"] > 2 * found.metrics["through_l1"]) == bright
