"""The camera's toe and shoulder: linear between, as smooth at their ends, and the same compiled and not."""

import numpy as np
from gel_pictures import Press

from tactile_core.pictures import renderer
from tactile_core.pictures.camera_curve import SHOULDER, TOE, curved
from tactile_core.sensors.calibration_file import load_calibration

REST = 100.0


def bent(levels):
    given = np.asarray(levels, np.float32)
    return curved(given.copy(), np.full_like(given, REST))


def test_linear_between_toe_and_shoulder_and_smooth_there():
    middle = np.linspace(TOE * REST, SHOULDER, 50)
    np.testing.assert_array_equal(bent(middle), middle.astype(np.float32))
    step = 0.5  # levels; of float32, whose step at 200 is 1.5e-5
    for end in (TOE * REST, SHOULDER):
        before, at, after = bent([end - step, end, end + step])
        assert abs((after - at) - (at - before)) < 0.01 * step


def test_every_level_stays_between_the_ends_and_in_order():
    levels = bent(np.linspace(-300, 600, 901))
    assert (np.diff(levels) >= 0).all() and levels.min() > 0 and levels.max() <= 255


def test_a_bright_untouched_gel_stays():
    rest = np.array([0.0, 30.0, 211.0, 254.0, 255.0], np.float32)
    np.testing.assert_array_equal(np.rint(curved(rest.copy(), rest)), rest)


def test_deep_contacts_hold_no_level_of_0_or_255_compiled_or_not(monkeypatch):
    unit = load_calibration().at_size(120, 160)
    drawer = renderer.Renderer(unit, "fast")
    heights = Press(right=-3e-3, down=-4e-3, depth=1.3e-3).on(unit.camera)
    linear = drawer.in_levels(drawer.radiance(heights) - drawer.rest_radiance) + drawer.background
    assert np.mean((linear < 0.5) | (linear > 254.5)) > 4e-3
    compiled = drawer(heights)
    monkeypatch.setattr(renderer, "available", lambda: False)
    plain = drawer(heights)
    assert np.mean((compiled == 0) | (compiled == 255)) <= 1e-3  # photographs of deep presses hold 1.5e-3
    assert np.abs(compiled.astype(int) - plain).max() <= 1  # sums in another order may round otherwise
