"""The camera's toe and shoulder: nothing between them, smooth where they begin, and the same compiled and not."""

import numpy as np
import pytest
from gel_pictures import Press

from tactile_core.pictures import renderer
from tactile_core.pictures.camera_curve import FLOOR, SHOULDER, TOE, bent, ends
from tactile_core.sensors.calibration_file import load_calibration

REST = 100.0


def curve(levels):
    change = np.asarray(levels, np.float32) - np.float32(REST)
    shown, slope = bent(change, ends(np.full_like(change, REST)))
    return REST + shown, slope


def test_linear_between_toe_and_shoulder_and_smooth_there():
    middle = np.linspace(TOE * REST, SHOULDER, 50)
    shown, slope = curve(middle)
    np.testing.assert_allclose(shown, middle, atol=1e-4)  # of float32
    np.testing.assert_allclose(slope, 1, atol=1e-5)
    step = 0.5  # levels
    for end in (TOE * REST, SHOULDER):
        before, at, after = curve([end - step, end, end + step])[0]
        assert abs((after - at) - (at - before)) < 0.02 * step  # step / reach / 2 is 0.8 % of it


def test_levels_stay_between_the_ends_and_in_order_and_slopes_are_theirs():
    levels = np.linspace(-300, 600, 9001)
    shown, slope = curve(levels)
    assert (np.diff(shown) >= 0).all() and shown.min() >= FLOOR * REST and shown.max() <= 255
    np.testing.assert_allclose(np.gradient(shown, levels), slope, atol=5e-3)  # steps of float32 are 3e-5 of 0.1


@pytest.mark.parametrize("rest", [-20.0, 0.0, 30.0, 211.0, 254.0, 255.0, 300.0])
def test_the_untouched_gel_stays(rest):
    assert bent(np.zeros(1, np.float32), ends(np.full(1, rest, np.float32)))[0] == 0


def test_deep_contacts_hold_no_level_of_0_or_255_compiled_or_not(monkeypatch):
    unit = load_calibration().at_size(120, 160)
    drawer = renderer.Renderer(unit, "fast")
    radiance = drawer.radiance(Press(right=-3e-3, down=-4e-3, depth=1.3e-3).on(unit.camera))
    linear = drawer.in_levels(radiance - drawer.rest_radiance) + drawer.background
    assert np.mean((linear < 0.5) | (linear > 254.5)) > 4e-3
    compiled = drawer.picture(radiance)
    monkeypatch.setattr(renderer, "available", lambda: False)
    plain = drawer.picture(radiance)
    assert np.mean((compiled == 0) | (compiled == 255)) <= 1e-3  # photographs of deep presses hold 1.5e-3
    assert np.abs(compiled.astype(int) - plain).max() <= 1  # sums in another order may round otherwise
