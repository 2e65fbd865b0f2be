"""What lies between the electrodes and a file is drawn from streams of its own, and read by the unit's own rest."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.sensors import divider
from tactile_core.sensors.readout import NOISE, REST_SPREAD, readings
from tactile_core.training.options import Options

TIME = np.arange(400) / sensors.SAMPLE_RATE
STILL = np.zeros((len(TIME), 19))


def read(change=STILL, seed=2, noise=0.0, drift=0.0):
    """Readings as whole numbers that may be subtracted."""
    return readings(change, TIME[: len(change)], seed, noise=noise, drift=drift).astype(int)


def test_a_unit_reads_changes_by_its_own_rest():
    """Simulated and turned back into the typical unit's, changes are those that went in."""
    change = np.linspace(-600, 60, len(TIME))[:, None] * np.ones(19)
    change[0] = 0
    counts = read(change)
    rest = counts[0]
    assert np.ptp(rest) > 200 and np.abs(rest - sensors.REST_COUNTS).max() <= REST_SPREAD
    np.testing.assert_allclose(divider.typical(counts - rest, rest), change, atol=1.1)  # half a count, up to 2.1 times


def test_readings_are_whole_and_stay_within_the_converter():
    counts = readings(STILL, TIME, 3, noise=1e5, drift=0.0)
    assert counts.dtype == np.int16 and counts.shape == (400, 19)
    assert (counts.min(), counts.max()) == (0, sensors.COUNT_MAX)


def test_noise_has_the_size_asked_for():
    spread = (read(noise=3.0) - read()).std()
    # 7,600 draws know it to 0.8 % (one deviation); rounding adds 1/12 to the variance
    assert spread == pytest.approx(np.sqrt(9 + 1 / 12), rel=0.03)


def test_drift_is_a_straight_line_within_its_rate():
    counts = read(drift=50.0)
    rate = np.polyfit(TIME, counts.astype(float), 1)[0]
    assert (np.abs(rate) < 50).all() and np.abs(rate).max() > 30 and rate.min() < 0 < rate.max()
    assert np.abs(counts - counts[0] - rate * TIME[:, None]).max() < 1  # two roundings, and the fit's own error


def test_each_defect_has_a_stream_of_its_own():
    """The rest and the drift drawn stay as they are when only the noise changes, and the other way round."""
    quiet, noisy = read(seed=9, drift=10.0), read(seed=9, drift=10.0, noise=1.0)
    assert np.abs((noisy - quiet).mean(axis=0)).max() < 0.25  # 400 frames know a mean to 0.05 counts (one deviation)
    still = read(seed=9)
    np.testing.assert_array_equal(still[0], quiet[0])
    # a stream that two defects shared would tie them: correlations of 19 independent draws stay below 0.7 (p = 0.001)
    drawn = [quiet[0] - sensors.REST_COUNTS, quiet[-1] - quiet[0], read(seed=9, noise=50.0)[0] - still[0]]
    assert np.abs(np.corrcoef(drawn)[np.triu_indices(3, 1)]).max() < 0.7


def test_a_longer_recording_begins_as_the_shorter_one():
    np.testing.assert_array_equal(read(noise=1.0, drift=1.0)[:150], read(STILL[:150], noise=1.0, drift=1.0))
    assert (read(seed=5) != read(seed=4)).any()


def test_networks_are_trained_with_the_noise_that_translation_must_bear():
    assert Options().noise == NOISE
