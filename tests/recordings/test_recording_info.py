"""``describe`` tells a person what a recording holds."""

import tracemalloc
import zipfile

import h5py
import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.recordings import PrepareOptions
from tactile_core.recordings.info import describe
from tactile_core.recordings.tables import table
from tactile_core.recordings.tables.column_map import ColumnMap


def test_a_good_recording(press, in_layout):
    text = describe(in_layout("csv_slide", press))
    for part in (
        "BioTac, 19 electrodes", "pac (22 a frame), pdc, tac, tdc", "700 in lines 2 to 701", "100.00 Hz", "6.99 s",
        "2020-01-26", "no gaps", "raw: whole numbers", "2 quiet parts", "removed, up to", "0 glitch samples", "none",
    ):  # fmt: skip
        assert part in text, part
    assert "warnings" not in text and max(map(len, text.splitlines())) < 200


def test_a_long_one_is_described_as_a_short_one(press, in_layout, monkeypatch):
    path = in_layout("csv_slide", press)
    whole = describe(path)
    monkeypatch.setattr(table, "WHOLE", 20_000)
    monkeypatch.setattr(table, "BLOCK", 20_000)
    assert describe(path) == whole


def test_long_counts_take_few_times_their_memory(press, tmp_path):
    """Two million rows took a gigabyte: in double precision, and sorted all at once."""
    counts = np.tile(press.electrodes.astype(np.int16), (150, 1))
    with h5py.File(tmp_path / "long.h5", "w") as file:
        file["electrode_vals/data"] = counts
    describe(tmp_path / "long.h5", PrepareOptions(tare="0:10"))  # what is imported takes memory once
    tracemalloc.start()
    try:
        describe(tmp_path / "long.h5")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 10.5 * counts.nbytes  # 9.3 measured, of them 2.5 for tables of any length; 13.2 before


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


def test_what_is_not_taken_is_named(press, tmp_path, write, slide_lines):
    """Whatever the container, an array or column that no layout picks is named."""
    scipy_io = pytest.importorskip("scipy.io", reason="scipy is absent: pip install tactile-core[matlab]")
    slide = [slide_lines[0] + ",wrench,label", *(line + "1,2" for line in slide_lines[1:])]
    write(slide, "touch.csv")
    arrays = {"electrodes": press.electrodes, "time": press.time, "wrench": np.zeros((700, 6)), "label": np.array("a")}
    np.savez(tmp_path / "touch.npz", **arrays)
    with zipfile.ZipFile(tmp_path / "touch.npz", "a") as archive:
        archive.writestr("notes.txt", "who, when")
    with h5py.File(tmp_path / "touch.h5", "w") as file:
        file["electrode_vals/data"], file["wrench/data"], file["label"] = press.electrodes, np.zeros((700, 6)), "a"
    fingers = {f"F{number}Electrodes": press.electrodes.T for number in (0, 1)}
    scipy_io.savemat(
        tmp_path / "touch.mat", {**fingers, "F1pdc": press.pdc[None], "wrench": 1.0, "label": "a", "F3pac": 2}
    )
    for name, left in (
        ("touch.csv", ("wrench",)),  # labels are kept
        ("touch.npz", ("wrench", "notes.txt")),
        ("touch.h5", ("wrench/data",)),
        ("touch.mat#0", ("wrench", "label", "F3pac")),
    ):
        assert recordings.read(tmp_path / name).not_taken == left
        assert f"not taken  {', '.join(left)}" in describe(tmp_path / name)


def test_what_is_not_taken_of_a_long_one_is_named_too(press, write, slide_lines, monkeypatch):
    path = write([slide_lines[0] + ",wrench", *(line + "1" for line in slide_lines[1:])])
    columns = ColumnMap(electrodes=tuple(f"ele{number}" for number in range(1, 20)), time="timestamp")
    told = [describe(path), describe(path, PrepareOptions(columns=columns))]
    assert "not taken  wrench\n" in told[0] and "not taken  tdc, tac, pdc, pac1" in told[1]
    monkeypatch.setattr(table, "WHOLE", 20_000)
    monkeypatch.setattr(table, "BLOCK", 20_000)
    assert [describe(path), describe(path, PrepareOptions(columns=columns))] == told


@pytest.mark.parametrize("layout", ["csv_slide", "csv_31", "npz_electrodes", "hdf5_electrode_vals", "hdf5_simulated"])
def test_a_known_layout_is_taken_whole(layout, press, in_layout):
    assert recordings.read(in_layout(layout, press)).not_taken == ()


@pytest.mark.parametrize("frames", [1, 2])
def test_few_frames(frames, press, in_layout):
    few = type(press)(**{k: v[:frames] if np.ndim(v) and len(v) == 700 else v for k, v in vars(press).items()})
    assert "no_quiet_part" in describe(in_layout("csv_31", few))
