"""Glitches and rows that came again are found, fast contacts are left alone."""

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.recordings import PrepareOptions, prepare, read, repair
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.repair import fill, find_glitches, is_time_series, smooth
from tactile_core.sensors import typical_rest


def marked(values):
    return np.argwhere(find_glitches(values)).tolist()


@pytest.mark.parametrize("length", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("size", [-3000, -60, 60, 800])
def test_short_glitches_on_rest_and_in_a_press_are_found(length, size, press):
    values = press.electrodes.copy()
    for start, j in ((40, 3), (350, 12)):
        values[start : start + length, j] += size
    expected = [[i, 3] for i in range(40, 40 + length)] + [[i, 12] for i in range(350, 350 + length)]
    assert marked(values) == expected


def test_a_dropout_of_many_electrodes_at_once_is_found(press):
    values = press.electrodes.copy()
    values[300, 6:14] = 0
    assert marked(values) == [[300, j] for j in range(6, 14)]


@pytest.mark.parametrize("rise", [0.02, 0.03, 0.1, 0.5])
def test_fast_presses_are_left_alone(rise, make):
    assert marked(make(rise=rise).electrodes) == []


@pytest.mark.parametrize("width", [3, 4, 5, 8, 20])
def test_round_taps_are_left_alone(width, press):
    """A half-sine of 30 ms and more, up to 300 counts, in all electrodes."""
    values = press.electrodes[:150].copy()
    tap = np.sin(np.pi * np.arange(1, width + 1) / (width + 1))
    values[60 : 60 + width] += np.rint(tap[:, None] * np.linspace(-300, 300, 19))
    assert marked(values) == []


def test_a_triangular_contact_of_full_slope_and_a_step_that_stays_are_left_alone():
    for contact in (50 * (10 - np.abs(np.arange(20) - 10)), np.full(100, 200)):
        values = np.pad(np.outer(contact, np.ones(19)), ((100, 100 if contact[-1] < 200 else 0), (0, 0)))
        assert marked(values) == []


def test_a_stuck_electrode_is_found_but_a_held_contact_is_not(press):
    stuck = press.electrodes[:150].copy()
    stuck[50:70, 4] += 190
    assert marked(stuck) == [[i, 4] for i in range(50, 70)]
    for contact in (np.full(19, 190), np.r_[50, np.linspace(-25, 25, 18)]):  # the second exceeds the limit at one
        held = press.electrodes[:150].copy()
        held[50:70] += np.rint(contact)
        assert marked(held) == []


def test_a_burst_of_glitches_spares_the_good_samples_between(press):
    values = press.electrodes[:150].copy()
    bad = [60, 62, 63, 66, 68, 69, 70]
    values[bad, 8] += 300
    assert marked(values) == [[i, 8] for i in bad]


@pytest.mark.parametrize("frame", [0, -1])
def test_glitches_at_the_ends_are_found(frame, press):
    values = press.electrodes.copy()
    values[frame, 5] = 0
    assert marked(values) == [[frame % len(values), 5]]


def test_unrelated_rows_are_no_time_series():
    random = np.random.default_rng(0)
    assert not is_time_series(find_glitches(random.choice([0.0, 100.0], (400, 19), p=[0.7, 0.3])))


def test_fill_takes_the_line_between_and_the_nearest_at_the_ends():
    values = np.array([[9.0], [1.0], [9.0], [3.0], [9.0]])
    bad = np.array([[True], [False], [True], [False], [True]])
    assert fill(values, bad)[:, 0].tolist() == [1, 1, 2, 3, 3]
    assert fill(values, np.ones((5, 1), bool))[:, 0].tolist() == [0] * 5


def test_the_search_ends_where_rows_are_no_time_series(monkeypatch):
    """A stranger's noise of some hours was searched for days: a call for each of millions of runs, in 12 rounds."""
    judged, rounds = [], []
    usual, ends = repair._leaves_usual, repair._end_runs
    monkeypatch.setattr(repair, "_leaves_usual", lambda *run: judged.append(run) or usual(*run))
    monkeypatch.setattr(repair, "_end_runs", lambda values: rounds.append(0) or ends(values))
    noise = np.random.default_rng(0).uniform(1800, 3600, (2000, 19))
    assert not is_time_series(find_glitches(noise))
    assert len(rounds) == 1
    assert len(judged) < noise.size / 10


def test_a_noisy_electrode_is_judged_in_few_pairs_of_jumps(press, monkeypatch):
    judged, usual = [], repair._leaves_usual
    monkeypatch.setattr(repair, "_leaves_usual", lambda *run: judged.append(run) or usual(*run))
    values = press.electrodes.copy()
    values[:, 3] = np.random.default_rng(0).uniform(1800, 3600, len(values))
    find_glitches(values)
    assert len(judged) < 5 * len(values)


def held(values: np.ndarray, rows: slice) -> np.ndarray:
    """Repeat the row before in place of some."""
    values = values.copy()
    values[rows] = values[rows.start - 1]
    return values


def noisy(noise: float, size: float = 15.0) -> np.ndarray:
    ramp = size * np.sin(np.linspace(0, 6, 400))[:, None] * np.linspace(1, 3, 19)
    return np.rint(3300 + ramp + noise * np.random.default_rng(0).standard_normal((400, 19)))


@pytest.mark.parametrize(("frames", "flag"), [(3, Flag.REPAIRED), (20, Flag.DEAD_CHANNEL)])
def test_rows_that_came_again_are_interpolated_and_long_runs_held_and_doubted(frames, flag):
    true, rows = noisy(1.2), slice(150, 150 + frames)
    signals = recordings.prepare(assemble("a", "text", electrodes=held(true, rows), stamps=None))
    marked = signals.flags & (Flag.REPAIRED | Flag.DEAD_CHANNEL)
    assert (marked[rows] == flag).all() and np.count_nonzero(marked) == frames
    left = np.abs(signals.electrodes[rows] - true[rows]).mean()
    assert (left < np.abs(held(true, rows) - true)[rows].mean()) == (flag == Flag.REPAIRED)
    assert any(f"{frames} frames repeat the row before" in text for text in signals.warnings)


@pytest.mark.parametrize(
    "values",
    [
        held(noisy(1.2), slice(150, 151)), held(noisy(0.0, size=5.0), slice(150, 160)), noisy(1.2),
        noisy(1.2)[np.arange(400) * 2 // 5],  # recorded two and a half times as fast as the finger answers
        held(held(noisy(0.0, size=300.0), slice(1, 60)), slice(300, 330)),  # a simulation without noise, at rest
    ],
)  # fmt: skip
def test_rows_that_came_twice_and_a_finger_without_noise_are_no_fault(values):
    signals = recordings.prepare(assemble("a", "text", electrodes=values, stamps=None))
    assert not (signals.flags & (Flag.REPAIRED | Flag.DEAD_CHANNEL)).any()


@pytest.mark.parametrize(
    ("factor", "doubt"),
    [(0.3, "number of bits"), (0.5, "which no film"), (3300 / 4095, "in mV?"), (1.0, ""), (1.15, "which no film")],
)
def test_electrodes_that_rest_where_no_unit_s_do_are_doubted(factor, doubt):
    counts = np.rint(factor * (np.array(typical_rest("biotac")) + np.random.default_rng(0).normal(0, 1.2, (400, 19))))
    signals = recordings.prepare(assemble("a", "text", electrodes=counts, stamps=None))
    assert ((signals.flags & Flag.OUT_OF_RANGE > 0) == bool(doubt)).all()
    told = [text for text in signals.warnings if "impedance" in text]
    assert len(told) == bool(doubt) and doubt in "".join(told)


def test_a_pressure_that_is_0_throughout_was_not_recorded():
    counts = noisy(1.2)
    zero, none = (
        recordings.prepare(assemble("a", "text", electrodes=counts, stamps=None, pdc=pdc))
        for pdc in (np.zeros(len(counts)), None)
    )
    assert any("PDC is 0" in text for text in zero.warnings) and np.isnan(zero.pdc).all()
    np.testing.assert_array_equal(zero.change, none.change)


def test_a_mean_round_each_frame():
    values = np.array([[0.0], [3.0], [6.0], [0.0]])
    np.testing.assert_allclose(smooth(values, 3), [[1.5], [3.0], [3.0], [3.0]])
    assert smooth(values, 1) is values
    np.testing.assert_allclose(smooth(values, 101), np.full((4, 1), 2.25))


def test_what_changes_evenly_stays_and_noise_falls_by_its_root():
    line = np.arange(1000.0)[:, None] * [1.0, -2.0]
    np.testing.assert_allclose(smooth(line, 5)[2:-2], line[2:-2])
    noise = np.random.default_rng(0).standard_normal((100_000, 1))
    assert smooth(noise, 9).std() == pytest.approx(1 / 3, rel=0.02)  # 100,000 draws, nine of them together


def test_rectified_recordings_are_smoothed_others_when_told(slide_csv):
    recording = read(slide_csv())
    plain, said = (prepare(recording, PrepareOptions(smooth=width, film=1.0)) for width in (None, 5))
    assert plain.report["smoothed_frames"] == 1 and said.report["smoothed_frames"] == 5
    np.testing.assert_allclose(said.change, smooth(plain.change, 5))
    np.testing.assert_array_equal(said.electrodes, plain.electrodes)
    folded = prepare(recording, PrepareOptions(kind="rectified", tare="none"))
    assert folded.report["smoothed_frames"] == 3


def averaged(columns, rows, mode="edge"):
    """Average columns (T, e) over an odd number of rows round each; mode : of ``numpy.pad``, beyond the ends."""
    padded = np.pad(columns, ((rows // 2, rows // 2), (0, 0)), mode=mode)
    return np.stack([np.convolve(column, np.ones(rows) / rows, "valid") for column in padded.T], axis=1)


@pytest.mark.parametrize("decimals", [0, 6])
@pytest.mark.parametrize("rows", [21, 51, 151])
def test_a_moving_average_is_told_and_flagged_where_it_moves(rows, decimals, press, tmp_path):
    def prepared(electrodes):
        np.savez(tmp_path / "touch.npz", electrodes=electrodes, time=press.time)
        return prepare(read(tmp_path / "touch.npz"))

    assert prepared(press.electrodes).warnings == ()
    found = prepared(averaged(press.electrodes, rows).round(decimals))
    assert "lack the noise" in " ".join(found.warnings)
    beyond = (found.flags & Flag.OUT_OF_RANGE) > 0
    edges = np.flatnonzero(np.diff(press.contact.astype(int)))
    assert beyond[edges].all() and (not beyond[:100].any() and not beyond[-50:].any() if rows < 100 else beyond.all())


@pytest.mark.parametrize("rows", [5, 51])
def test_ends_averaged_with_zeros_are_no_touch(rows, press, tmp_path):
    np.savez(tmp_path / "touch.npz", electrodes=averaged(press.electrodes, rows, "constant"), time=press.time)
    found = prepare(read(tmp_path / "touch.npz"))
    assert "averaged with zeros" in " ".join(found.warnings)
    ends = np.r_[: rows // 2, len(press.time) - rows // 2 : len(press.time)]
    assert (found.flags[ends] & Flag.DEAD_CHANNEL).all() and np.abs(found.change[ends]).max() < 10
