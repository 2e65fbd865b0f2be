"""Light of the object through the coating: found again by one number, and drawn by every picture."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from plain_unit import plain_unit
from pressed_unit import BALL, PLACES, write_photographs

from tactile_core.pictures.calibrate.evaluate import evaluate_unit
from tactile_core.pictures.calibrate.fit import calibrate
from tactile_core.pictures.calibrate.photographs import read_photographs
from tactile_core.sensors.calibration import Coating

THIN = dataclasses.replace(plain_unit().at_size(60, 80), coating=Coating(transmission=0.25))


@pytest.mark.usefixtures("coarse_fits")
@pytest.mark.parametrize("reflectance", [0.0, 0.8])
def test_object_shows_through_in_the_photographs_of_others(tmp_path: Path, reflectance: float) -> None:
    """Rows `through` know the object from the other photographs; all others are of the file's black one."""
    shown = dataclasses.replace(THIN, object_reflectance=reflectance)
    folder = write_photographs(tmp_path / "presses", shown, PLACES[:3])
    photographs = read_photographs(folder, tmp_path / "untouched.png")
    for found in evaluate_unit(THIN, photographs, BALL, search_radius=False):
        assert found.through == pytest.approx(0.25 * reflectance, abs=0.015)  # measured 0.004; 2 levels of noise
        assert found.metrics["through_l1"] < 2.5
        bright = reflectance > 0
        assert any("comes through it from the ball" in flag for flag in found.flags) == bright
        assert (found.metrics["roi_l1"] > 1.5 * found.metrics["through_l1"]) == bright


@pytest.mark.usefixtures("coarse_fits")
def test_fit_tells_the_coating_s_transmission_of_a_known_object(tmp_path: Path) -> None:
    shown = dataclasses.replace(THIN, object_reflectance=0.6)
    folder = write_photographs(tmp_path / "presses", shown, PLACES[:3])
    photographs = read_photographs(folder, tmp_path / "untouched.png")
    found = calibrate(photographs, 2 * BALL, plain_unit(), unit="u", quick=True, reflectance=0.6).calibration
    assert found.object_reflectance == 0.6
    assert found.coating.transmission == pytest.approx(0.25, abs=0.05)  # standard error of three presses 0.04


def test_more_light_than_a_white_object_s_is_the_coating_s() -> None:
    assert THIN.with_through(0.1).object_reflectance == pytest.approx(0.4)
    brighter = THIN.with_through(0.3)
    assert (brighter.coating.transmission, brighter.object_reflectance) == (0.3, 1.0)
    assert np.isclose(plain_unit().with_through(0.0).object_reflectance, 0)
