"""What lies between the electrodes and a file is drawn from streams of its own, and read by the unit's own rest."""

import dataclasses

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.sensors import divider
from tactile_core.sensors.readout import NOISE, Wiring, readings
from tactile_core.training.options import Options

IDEAL = Wiring(rest_spread=0, gain_error=0, drift=0, noise=0)
TIME = np.arange(400) / sensors.SAMPLE_RATE
STILL = np.zeros((len(TIME), 19))


def test_a_unit_reads_changes_by_its_own_rest():
    """Simulated and turned back into the typical unit's, changes are those that went in."""
    change = np.linspace(-600, 60, len(TIME))[:, None] * np.ones(19)
    change[0] = 0
    counts = readings(change, TIME, dataclasses.replace(IDEAL, rest_spread=300), seed=2)
    rest = counts[0]
    assert np.ptp(rest) > 200 and np.ptp(counts[1] - rest) > 50
    np.testing.assert_allclose(divider.typical(counts - rest, rest), change, atol=1.1)  # half a count, up to 2.1 times


def test_ideal_wiring_rounds_and_saturates():
    change = STILL.copy()
    change[10], change[20], change[30] = 1e4, -1e4, 0.4
    change[40] = 0.6
    counts = readings(change, TIME, IDEAL, seed=3)
    assert counts.dtype == np.int16 and counts.shape == (400, 19)
    assert (counts[10] == sensors.COUNT_MAX).all() and (counts[20] == 0).all()
    assert (counts[30] == sensors.REST_COUNTS).all() and (counts[40] == sensors.REST_COUNTS + 1).all()


def test_noise_has_the_size_asked_for():
    counts = readings(STILL, TIME, dataclasses.replace(IDEAL, noise=3.0), seed=1)
    spread = (counts - sensors.REST_COUNTS).std()
    # 7,600 draws know it to 0.8 % (one deviation); rounding adds 1/12 to the variance
    assert spread == pytest.approx(np.sqrt(9 + 1 / 12), rel=0.03)


def test_drift_is_a_straight_line_within_its_rate():
    counts = readings(STILL, 100 * TIME, dataclasses.replace(IDEAL, drift=0.5), seed=2)
    rate = np.polyfit(100 * TIME, counts.astype(float), 1)[0]
    assert (np.abs(rate) < 0.5).all() and np.abs(rate).max() > 0.3 and rate.min() < 0 < rate.max()
    line = sensors.REST_COUNTS + rate * (100 * TIME)[:, None]
    assert np.abs(counts - line).max() < 0.75  # half a count of rounding, and the fit's own error


def test_gain_scales_changes_but_not_rest():
    wiring = dataclasses.replace(IDEAL, gain_error=0.2)
    change = np.zeros((3, 19))
    change[1:] = [[-200.0], [-400.0]]
    moved = readings(change, TIME[:3], wiring, seed=5) - sensors.REST_COUNTS
    np.testing.assert_array_equal(moved[0], 0)
    np.testing.assert_allclose(moved[2], 2 * moved[1], atol=1.5)  # three roundings
    gain = np.log(moved[2] / -400)
    assert 0.1 < gain.std() < 0.3  # 19 draws know 0.2 to 16 % (one deviation)


def test_tared_counts_are_raw_ones_less_their_rest():
    wiring = dataclasses.replace(IDEAL, rest_spread=150, noise=1.0)
    raw = readings(STILL, TIME, wiring, seed=7).astype(int)
    tared = readings(STILL, TIME, dataclasses.replace(wiring, tared=True), seed=7)
    rest = raw - tared
    assert tared.dtype == np.int16 and abs(tared.mean()) < 0.1
    np.testing.assert_array_equal(rest, rest[:1].repeat(len(TIME), 0))
    assert rest[0].std() > 40 and np.abs(rest - sensors.REST_COUNTS).max() <= 150


def test_each_defect_has_a_stream_of_its_own():
    """The rest and the drift drawn stay as they are when only the noise changes, and the other way round."""
    wiring = Wiring(rest_spread=100, gain_error=0.1, drift=10.0, noise=0.0)
    quiet = readings(STILL, TIME, wiring, seed=9).astype(int)
    noisy = readings(STILL, TIME, dataclasses.replace(wiring, noise=1.0), seed=9).astype(int)
    assert np.abs((noisy - quiet).mean(axis=0)).max() < 0.25  # 400 frames know a mean to 0.05 counts (one deviation)
    still = readings(STILL, TIME, dataclasses.replace(wiring, drift=0.0), seed=9)
    np.testing.assert_array_equal(still[0], quiet[0])
    # a stream that two defects shared would tie them: correlations of 19 independent draws stay below 0.7 (p = 0.001)
    rest, drift = quiet[0] - sensors.REST_COUNTS, quiet[-1] - quiet[0]
    noise = readings(STILL, TIME, dataclasses.replace(IDEAL, noise=50.0), seed=9)[0] - sensors.REST_COUNTS
    assert np.abs(np.corrcoef([rest, drift, noise])[np.triu_indices(3, 1)]).max() < 0.7


def test_a_longer_recording_begins_as_the_shorter_one():
    long, short = (readings(STILL[:n], TIME[:n], Wiring(drift=1.0), seed=4) for n in (400, 150))
    np.testing.assert_array_equal(long[:150], short)
    assert (readings(STILL, TIME, Wiring(), seed=5) != readings(STILL, TIME, Wiring(), seed=4)).any()


@pytest.mark.parametrize(
    ("field", "value"),
    [("noise", -1.0), ("noise", np.nan), ("drift", np.inf), ("drift", -0.1), ("gain_error", 1.5), ("rest_spread", 900)],
)
def test_impossible_wiring_names_the_field(field, value):
    with pytest.raises(TactileError, match=f"wiring, {field}"):
        Wiring(**{field: value})


def test_networks_are_trained_with_the_noise_that_translation_must_bear():
    assert Options().noise == NOISE
