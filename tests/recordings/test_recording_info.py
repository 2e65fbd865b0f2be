"""``describe`` tells a person what a recording holds."""

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.recordings.info import describe
from tactile_core.recordings.tables import table


def test_a_good_recording(press, in_layout):
    text = describe(in_layout("csv_slide", press))
    for part in (
        "BioTac, 19 electrodes",
        "pac (22 a frame), pdc, tac, tdc",
        "700 in lines 2 to 701",
        "100.00 Hz",
        "6.99 s",
        "2020-01-26",
        "no gaps",
        "raw: whole numbers",
        "2 quiet parts",
        "removed, up to",
        "0 glitch samples",
        "none",
    ):
        assert part in text, part
    assert "warnings" not in text and max(map(len, text.splitlines())) < 200


def test_a_long_one_is_described_as_a_short_one(press, in_layout, monkeypatch):
    path = in_layout("csv_slide", press)
    whole = describe(path)
    monkeypatch.setattr(table, "WHOLE", 20_000)
    monkeypatch.setattr(table, "BLOCK", 20_000)
    assert describe(path) == whole


def test_a_simulated_one_says_so(press, in_layout):
    text = describe(in_layout("hdf5_simulated", press))
    assert "simulated: a made-up press" in text and "truth (12 BioTac and 9 DIGIT nodes)" in text


def test_suspicious_places_are_named_by_line(press, in_layout):
    press.electrodes[4, 6:14] = 0
    press.time[50:] += 0.02
    press.electrodes[99, 0] = np.nan
    text = describe(in_layout("csv_slide", press))
    for part in (
        "8 glitch samples, 1 unreadable samples, in line 6, 101",
        "1 jumps, before line 52",
        "line 101, ele1: 'nan' is not a number",
        "line 6: glitch in E7 0",
        "repaired 2, time_jump 1 of 700 frames",
    ):
        assert part in text, part


@pytest.mark.parametrize("frames", [1, 2])
def test_few_frames(frames, press, in_layout):
    few = type(press)(**{k: v[:frames] if np.ndim(v) and len(v) == 700 else v for k, v in vars(press).items()})
    assert "no_quiet_part" in describe(in_layout("csv_31", few))


def test_no_recording(tmp_path):
    with pytest.raises(TactileError, match="no such file"):
        describe(tmp_path / "absent.csv")
