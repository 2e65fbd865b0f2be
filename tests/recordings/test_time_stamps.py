"""Time stamps that are none, and rates that the filters were not made for: read, and said."""

import numpy as np
import pytest

from tactile_core import recordings


def read(folder, time):
    random = np.random.default_rng(3)
    electrodes = np.rint(3000 + random.normal(0, 1, (200, 19)))
    np.savez(folder / "a.npz", electrodes=electrodes, time=time)
    return recordings.read(folder / "a.npz")


@pytest.mark.parametrize("stamp", [np.nan, 1e300, np.inf])
def test_stamps_that_are_no_times_are_told(stamp, tmp_path):
    found = read(tmp_path, np.full(200, stamp))
    assert any("none of 200 time stamps" in text and "100 Hz assumed" in text for text in found.warnings)
    some = np.arange(200) / 100
    some[7:9] = stamp
    found = read(tmp_path, some)
    assert any("2 of 200 time stamps" in text for text in found.warnings)
    np.testing.assert_allclose(found.time, np.arange(200) / 100)


@pytest.mark.parametrize("rate", [25, 50, 90, 100, 150, 1000])
def test_other_rates_are_told(rate, tmp_path):
    found = read(tmp_path, np.arange(200) / rate)
    reported = any(f"{rate} frames a second" in text for text in found.warnings)
    assert reported == (not 62.5 <= rate <= 160)
