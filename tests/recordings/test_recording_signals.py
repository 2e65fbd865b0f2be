"""Kind, tare, drift: found, reported, overridable."""

import dataclasses
import json
import tracemalloc

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings import PrepareOptions
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.electrode_faults import _still
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.quiet import find_quiet
from tactile_core.recordings.signal_kind import KINDS

NOISE = 0.6  # counts; 1.2 over 175 quiet and 225 held frames deviate by 0.13; 4.5 deviations for the largest of 19


def make_recording(press, electrodes=None, pdc=True, part=slice(None)):
    electrodes = press.electrodes if electrodes is None else electrodes
    return assemble(
        "press.npz", "NPZ", electrodes=electrodes[part], stamps=press.time[part], pdc=press.pdc[part] if pdc else None
    )


def as_kind(press, kind):
    tared = press.electrodes - np.rint(press.rest)
    return {"raw": press.electrodes, "tared": tared, "scaled": tared / 300, "rectified": np.abs(tared)}[kind]


def error_of(signals, press, part=slice(None)):
    """Largest difference between the mean change of the quiet and of the held frames and the truth, counts."""
    change, truth = signals.change, press.change[part]
    return np.abs((change - truth)[truth.any(axis=1)].mean(axis=0)).max()


@pytest.mark.parametrize("pdc", [True, False])
@pytest.mark.parametrize("kind", ["raw", "tared"])
def test_true_changes_come_back_with_tare_and_drift(kind, pdc, press):
    signals = recordings.prepare(make_recording(press, as_kind(press, kind), pdc))
    assert signals.kind == kind and not signals.flags.any()
    assert error_of(signals, press) < NOISE
    assert not (signals.quiet & press.contact).sum() > 3  # frames of a window may see the first 0.03 s of the rise
    # counts/s: 0.3 counts of level over 5 s between the parts
    np.testing.assert_allclose(signals.drift, press.drift, atol=0.1)
    json.dumps(signals.report)


def test_rest_is_the_start_s_where_the_skin_creeps_after_a_contact(make):
    """A real finger's pressure falls by 1.7 counts below that of its first 9 s, which read .35 N."""
    press = make(slope=0)
    after = np.arange(700) > np.flatnonzero(press.contact).max()
    press.electrodes = np.rint(press.electrodes + 18 * after[:, None])
    press.pdc = press.pdc - 1.7 * after
    signals = recordings.prepare(make_recording(press))
    assert signals.quiet[20:150].all() and not signals.quiet[after].any() and error_of(signals, press) < NOISE


@pytest.mark.parametrize("part", [slice(0, 400), slice(300, 700)], ids=["rest at the start", "rest at the end"])
@pytest.mark.parametrize("pdc", [True, False])
def test_a_quiet_part_is_found_wherever_it_lies(part, pdc, make):
    press = make(slope=0)
    signals = recordings.prepare(make_recording(press, pdc=pdc, part=part))
    assert signals.quiet.any() and error_of(signals, press, part) < NOISE


def test_a_quiet_part_in_the_middle_is_found(make):
    press = make(slope=0)
    order = np.r_[250:525, 525:700, 175:450]  # press, release and rest, press again
    press = type(press)(**{k: v[order] if np.ndim(v) and len(v) == 700 else v for k, v in vars(press).items()})
    press.time = np.arange(len(order)) / 100
    signals = recordings.prepare(make_recording(press))
    assert np.flatnonzero(signals.quiet).min() > 230 and error_of(signals, press) < NOISE


def test_a_held_press_is_not_rest_where_pdc_tells(make):
    press = make(slope=0)
    press.electrodes = np.rint(
        press.rest + (press.contact * 100)[:, None] + np.random.default_rng(2).normal(0, 1.2, (700, 19))
    )
    signals = recordings.prepare(make_recording(press, part=slice(200, 700)))
    assert not (signals.quiet & press.contact[200:]).any() and signals.quiet.any()


def test_contact_is_never_taken_for_drift(make):
    press = make(slope=0)
    creep = press.contact * np.linspace(0, 60, 700)
    signals = recordings.prepare(make_recording(press, np.rint(press.electrodes + creep[:, None])))
    assert np.abs(signals.drift).max() < 0.1  # counts/s, see above
    assert np.abs(signals.change[350] - press.change[350] - creep[350]).max() < 6  # noise of one frame, 4 deviations


def test_drift_can_be_left_in(press):
    signals = recordings.prepare(make_recording(press), PrepareOptions(drift=False))
    assert not signals.drift.any() and not signals.report["drift_removed"]


def test_rectified_recordings_are_flagged_and_tared_at_their_end(make):
    press = make(slope=0)
    recording = make_recording(press, as_kind(press, "rectified"), part=slice(300, 700))
    recording.pdc[:] -= 1500
    signals = recordings.prepare(recording)
    assert signals.kind == "rectified" and (signals.flags == Flag.RECTIFIED).all()
    assert signals.quiet[300:].all() and not signals.quiet[:200].any()
    assert any("rectified" in warning for warning in signals.warnings)


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_are_told_with_evidence_and_can_be_overridden(kind, press):
    recording = make_recording(press, as_kind(press, kind))
    signals = recordings.prepare(recording)
    assert signals.kind == kind and signals.report["kind_evidence"]
    other = "tared" if kind != "tared" else "rectified"
    overridden = recordings.prepare(recording, PrepareOptions(kind=other))
    assert overridden.kind == other and f"look {kind}" in overridden.report["kind_evidence"]


def test_scaled_recordings_say_that_their_unit_is_unknown(press):
    recording = make_recording(press, as_kind(press, "scaled"))
    signals = recordings.prepare(recording)
    assert any("counts_per_unit" in warning for warning in signals.warnings)
    said = recordings.prepare(recording, PrepareOptions(counts_per_unit=300))
    assert error_of(said, press) < NOISE and not said.warnings


def test_tare_frames_can_be_told(press):
    recording = make_recording(press)
    for tare in ("0:100", slice(0, 100), ":100", "-700:100"):
        signals = recordings.prepare(recording, PrepareOptions(tare=tare))
        assert np.flatnonzero(signals.quiet).tolist() == list(range(100))
        np.testing.assert_allclose(signals.rest, press.electrodes[:100].mean(axis=0), atol=NOISE)


@pytest.mark.parametrize("tare", ["600:900", "50:50", "90:10", "a:b", "5", "0:10:2", slice(0, 701), "-900:10"])
def test_tare_frames_outside_are_an_error(tare, press):
    with pytest.raises(TactileError, match="option tare"):
        recordings.prepare(make_recording(press), PrepareOptions(tare=tare))


def test_no_tare(press):
    tared = as_kind(press, "tared")
    signals = recordings.prepare(make_recording(press, tared), PrepareOptions(tare="none"))
    np.testing.assert_array_equal(signals.change, tared)
    assert (signals.flags & Flag.NO_QUIET_PART).all()
    with pytest.raises(TactileError, match="raw recording"):
        recordings.prepare(make_recording(press), PrepareOptions(tare="none"))


@pytest.mark.parametrize(
    ("field", "values", "said"),
    [
        ("kind", ["Raw"], "raw, tared, scaled, rectified"), ("counts_per_unit", [0, -1], "counts a unit, above 0"),
        ("smooth", [0, 2, -3, 103], "an odd number from 1 to 101"), ("polarity", ["up"], "auto, falls, rises"),
        ("film", [0.05, 30.0, np.nan], "0.2 to 3 of a typical unit's"),
    ],
)  # fmt: skip
def test_options_that_make_no_sense_are_an_error(field, values, said, press):
    for value in values:
        with pytest.raises(TactileError, match=f"option {field}: .*; expected {said}"):
            recordings.prepare(make_recording(press), PrepareOptions(**{field: value}))


@pytest.mark.parametrize("frames", [1, 2, 5, 29])
def test_shorter_than_the_tare_window_converts_with_a_flag(frames, press):
    signals = recordings.prepare(make_recording(press, part=slice(0, frames)))
    assert (signals.flags & Flag.NO_QUIET_PART).all() and np.isfinite(signals.change).all()
    assert any("fewer than the 30 of the tare window" in warning for warning in signals.warnings)


def test_without_a_quiet_part_frames_are_flagged(make):
    press = make(rise=2.0)
    recording = make_recording(press, as_kind(press, "tared"), part=slice(220, 500))
    signals = recordings.prepare(recording)
    assert (signals.flags & Flag.NO_QUIET_PART).all() and not signals.quiet.any()
    assert any("no quiet part" in warning for warning in signals.warnings)


def test_saturated_frames_are_flagged(press):
    press.electrodes[300:360, 2] = 4095
    press.electrodes[300:360, 3] = 0
    signals = recordings.prepare(make_recording(press), PrepareOptions(repair=False))
    assert np.flatnonzero(signals.flags & Flag.SATURATED).tolist() == list(range(300, 360))
    assert any("E3, E4 at an end of the 12-bit range in 60 frames" in warning for warning in signals.warnings)


def test_a_dead_channel_is_flagged_only_where_time_enough_passed(press):
    press.electrodes[:, 6] = 3300
    signals = recordings.prepare(make_recording(press))
    assert (signals.flags == Flag.DEAD_CHANNEL).all() and signals.warnings == ("E7 never changes: dead channel",)
    assert not (recordings.prepare(make_recording(press, part=slice(0, 99))).flags & Flag.DEAD_CHANNEL).any()


def test_standing_still_is_a_fault_only_while_others_move(press):
    random = np.random.default_rng(0)
    steady = 3000 + np.rint(random.normal(0, 0.8, (600, 19)))
    steady[100:300, 6] = steady[100, 6]
    assert not _still(steady).any()  # a steady grip
    moving = steady + np.outer(np.linspace(0, 60, 600).round(), np.arange(19) > 8)
    moving[100:300, 6] = moving[100, 6]
    assert np.flatnonzero(_still(moving).any(axis=1)).tolist() == list(range(100, 300))


def test_repair_is_reported_with_its_line_and_can_be_turned_off(press, slide_lines, write):
    cells = slide_lines[5].split(",")
    cells[26 + 6 : 26 + 14] = ["0"] * 8
    slide_lines[5] = ",".join(cells)
    recording = recordings.read(write(slide_lines))
    signals = recordings.prepare(recording)
    assert np.flatnonzero(signals.flags & Flag.REPAIRED).tolist() == [4] and signals.report["samples_glitch"] == 8
    assert signals.warnings[0].startswith("line 6: glitch in E7 0, E8 0") and np.abs(signals.change[4]).max() < 6
    kept = recordings.prepare(recording, PrepareOptions(repair=False))
    assert not (kept.flags & Flag.REPAIRED).any() and kept.change[4, 6] < -2900


def test_input_is_not_changed(press):
    recording = make_recording(press)
    before, flags = recording.electrodes.copy(), recording.flags.copy()
    recordings.prepare(recording)
    np.testing.assert_array_equal(recording.electrodes, before)
    np.testing.assert_array_equal(recording.flags, flags)


@pytest.mark.parametrize("step", [5e-324, 1e-310, 1e-9])
def test_stamps_that_hardly_differ_have_a_rate(step, press):
    recording = assemble("a.npz", "NPZ", electrodes=press.electrodes, stamps=np.arange(len(press.time)) * step)
    assert recording.rate == pytest.approx(1e6)
    assert len(recordings.prepare(recording).change) == len(recording)


def test_a_long_recording_is_prepared_in_few_times_its_own_memory(press):
    """Sums over windows of all electrodes at once took eight times the recording: 1.5 GB for a million rows."""
    electrodes = np.tile(press.electrodes, (100_000 // len(press.electrodes), 1))
    long = assemble("press.npz", "NPZ", electrodes=electrodes, stamps=np.arange(len(electrodes)) / 100)
    tracemalloc.start()
    try:
        recordings.prepare(long)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 6 * electrodes.nbytes  # 4.9 measured; 9 with the sums


def test_a_pressure_that_is_no_number_is_said(make):
    recording = make_recording(make())
    recording.pdc[:7] = np.nan
    signals = recordings.prepare(recording)
    assert f"PDC has no number in 7 of {len(recording)} frames" in "\n".join(signals.warnings)
    assert np.isnan(signals.pdc[:7]).all() and np.isfinite(signals.pdc[7:]).all()


def test_rest_is_followed_where_it_drifts_further_than_a_press():
    frames = np.arange(40_000)
    drift = np.interp(frames, [0, 20_000, 40_000], [0, 16, 0])[:, None] * np.linspace(-1, 1, 19)
    electrodes = 3000 + drift + np.random.default_rng(1).normal(0, 0.7, (len(frames), 19))
    electrodes[38_000:39_000] -= 15.0  # a steady grip as large as the drift, which after so long may be rest
    quiet = find_quiet(electrodes, None, 100.0, "raw").mask
    assert quiet[:37_000].mean() > 0.9 and quiet[39_100:].mean() > 0.9 and not quiet[38_000:39_000].any()


@pytest.mark.parametrize(
    ("field", "change"),
    [
        ("time", lambda values: values[:300]),
        ("time", lambda values: np.tile(values, 2)),
        ("pdc", lambda values: values[:, None]),
        ("electrodes", lambda values: values.astype(str)),
        pytest.param(
            "electrodes",
            lambda values: values.astype(np.longdouble),
            marks=pytest.mark.skipif(np.longdouble(0).itemsize == 8, reason="no longer than double here"),
        ),
        ("electrodes", lambda values: np.ma.masked_less(values, 3000)),
        ("flags", lambda values: values.astype(float)),
    ],
)
def test_arrays_that_hands_made_unlike_are_refused_by_name(field, change, press):
    recording = make_recording(press)
    by_hand = dataclasses.replace(recording, **{field: change(getattr(recording, field))})
    with pytest.raises(TactileError, match=rf"{field}: a \w+ .* expected a plain numpy array"):
        recordings.prepare(by_hand)


def test_hands_that_put_time_back_or_cut_samples_out_are_flagged(press):
    recording = make_recording(press)
    time, electrodes = recording.time.copy(), recording.electrodes.copy()
    time[300:] -= 1.0
    electrodes[20, 3] = np.nan
    found = recordings.prepare(dataclasses.replace(recording, time=time, electrodes=electrodes)).flags
    assert found.nonzero()[0].tolist() == [20, 300]
    assert found[[20, 300]].tolist() == [Flag.REPAIRED, Flag.TIME_JUMP] and not recording.flags.any()
