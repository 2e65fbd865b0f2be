"""The real recordings at hand: all read, judged as the notes beside them say."""

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings.flags import Flag


@pytest.fixture(scope="module")
def slide(outside_data):
    folder = outside_data("biotac_recordings") / "slide"
    paths = sorted(folder.glob("*_bio.csv"))
    assert paths, f"{folder} holds no *_bio.csv"
    return [(recording, recordings.prepare(recording)) for recording in map(recordings.read, paths)]


def test_all_slide_recordings_read_whole(slide):
    for recording, signals in slide:
        with open(recording.path) as file:
            assert len(recording) == sum(1 for _ in file) - 1
        assert recording.warnings == () and recording.rate == pytest.approx(100, rel=0.01)
        assert np.isfinite(signals.change).all() and recording.start_time > 1.5e9


def test_all_are_told_to_be_rectified(slide):
    assert {signals.kind for _, signals in slide} == {"rectified"}
    assert all((signals.flags & Flag.RECTIFIED).all() for _, signals in slide)


def test_quiet_is_found_where_contact_is_lost_and_nowhere_else(slide):
    """The notes: contact is lost in the last second of about a third; there PDC < 2. No other part is quiet."""
    for recording, signals in slide:
        late = recording.pdc[-100:]
        if signals.quiet.any():
            assert recording.pdc[signals.quiet].mean() < 2
            assert np.flatnonzero(signals.quiet).max() > len(recording) // 2
        else:
            assert (signals.flags & Flag.NO_QUIET_PART).all()
            assert late.mean() > 0.5, recording.name  # nowhere a second without pressure that was missed
    found = sum(bool(signals.quiet.any()) for _, signals in slide)
    assert len(slide) / 5 < found < len(slide) / 2


def test_only_recordings_with_dropouts_are_repaired(slide):
    """The notes: samples over 30 counts from the median of 11 are glitches; where there are none nothing may change."""
    for recording, signals in slide:
        padded = np.pad(recording.electrodes, ((5, 5), (0, 0)), mode="edge")
        median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 11, axis=0), axis=-1)
        far = bool((np.abs(recording.electrodes - median) > 30).any())
        assert bool(signals.report["samples_glitch"]) == far, recording.name
        # contacts of the set stay below 200, drop-outs read thousands
        assert signals.electrodes.max() < 300, recording.name


def test_the_dropout_of_mat5_50_is_repaired(slide):
    found = [(r, s) for r, s in slide if r.name == "mat5_50_bio"]
    if not found:
        pytest.skip("mat5_50_bio.csv is not in the folder")
    recording, signals = found[0]
    frame = int(np.argmax(recording.electrodes.max(axis=1)))
    assert recording.rows[frame] == 7 and recording.electrodes[frame].max() > 3000
    assert signals.flags[frame] & Flag.REPAIRED and signals.electrodes[frame].max() < 120
    assert any(warning.startswith("line 7: glitch in") for warning in signals.warnings)


@pytest.mark.parametrize("topic", ["cw", "cp"])
def test_wrench_and_pose_files_are_no_recordings(topic, outside_data):
    path = next((outside_data("biotac_recordings") / "slide").glob(f"*_{topic}.csv"))
    with pytest.raises(TactileError, match="no known recording: columns 'timestamp"):
        recordings.read(path)
