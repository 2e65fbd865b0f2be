"""A recording in parts is the recording."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings import chunks, quiet, rest_level
from tactile_core.recordings.tables import table
from tactile_core.recordings.tables.column_map import ColumnMap


def joined(path):
    found = list(chunks.read_parts(path))
    columns = {
        name: np.concatenate([getattr(part.recording, name)[part.repeated :] for part in found])
        for name in ("electrodes", "time", "pdc", "rows")
        if getattr(found[0].recording, name) is not None
    }
    return columns, found


@pytest.mark.parametrize("layout", ["csv_slide", "csv_31", "hdf5_electrode_vals", "hdf5_simulated"])
def test_parts_join_to_the_whole(layout, make, in_layout, monkeypatch):
    monkeypatch.setattr(chunks, "TEXT_BYTES", 30_000)
    monkeypatch.setattr(chunks, "ARRAY_BYTES", 100_000)
    path = in_layout(layout, make(frames=1500))
    whole, (columns, found) = recordings.read(path), joined(path)
    assert len(found) > 2 and all(part.repeated == chunks.CONTEXT for part in found[2:])
    for name, values in columns.items():
        if name == "rows" and layout.startswith("hdf5"):
            continue  # counted from each part's first frame
        np.testing.assert_allclose(values, getattr(whole, name), atol=1e-6, err_msg=name)  # stamps of 1.6e9 s: 2e-7


def test_a_text_too_long_to_read_whole_is_read_in_parts(slide_lines, write, monkeypatch):
    monkeypatch.setattr(table, "MAX_BYTES", 1000)
    monkeypatch.setattr(chunks, "TEXT_BYTES", 1000)
    path = write(slide_lines)
    with pytest.raises(TactileError, match="read it in parts: `tactile batch`"):
        recordings.read(path)
    assert len(joined(path)[0]["electrodes"]) == len(slide_lines) - 1


def test_short_recordings_and_npz_are_one_part(make, in_layout):
    for layout in ("csv_slide", "npz_electrodes", "hdf5_simulated"):
        (part,) = chunks.read_parts(in_layout(layout, make(frames=60)))
        assert part.repeated == 0 and len(part.recording) == 60


def test_a_bad_cell_far_into_a_long_text_is_told_with_its_line(slide_lines, write, monkeypatch):
    monkeypatch.setattr(chunks, "TEXT_BYTES", 30_000)
    slide_lines[600] = slide_lines[600].replace("2000", "x", 1)
    _, found = joined(write(slide_lines))
    assert any("line 601" in text for part in found for text in part.recording.warnings)


def test_a_text_without_lines_costs_no_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "TEXT_BYTES", 1000)
    monkeypatch.setattr(table, "MAX_LINE", 1000)
    (tmp_path / "a.csv").write_bytes(b"7" * 5000)
    with pytest.raises(TactileError, match="a line of over"):
        list(chunks.read_parts(tmp_path / "a.csv"))


def blocks_of_20_kb(monkeypatch):
    monkeypatch.setattr(table, "WHOLE", 20_000)
    monkeypatch.setattr(table, "BLOCK", 20_000)


def test_a_long_text_is_read_in_blocks_like_a_short_one(slide_lines, write, monkeypatch):
    slide_lines[600] = slide_lines[600].replace("2000", "x", 1)
    slide_lines.insert(400, "")
    slide_lines[-1] = slide_lines[-1].rstrip(",")[:-3]  # cut in its last cell
    path = write(slide_lines, end="")
    whole = recordings.read(path)
    blocks_of_20_kb(monkeypatch)
    found = recordings.read(path)
    assert found.warnings == whole.warnings and any("line 602" in text for text in found.warnings)
    for name in ("time", "electrodes", "pdc", "pac", "tdc", "rows", "flags"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))


def test_a_lean_recording_gives_the_same_signals(slide_lines, write, monkeypatch):
    blocks_of_20_kb(monkeypatch)
    slide_lines[600] = slide_lines[600].replace("2000", "x", 1)  # in PAC, which is left out: told all the same
    path = write(slide_lines)
    whole, lean = recordings.read(path), recordings.read(path, lean=True)
    assert lean.pac is None and whole.pac is not None and lean.warnings == whole.warnings
    assert lean.electrodes.dtype == np.float32 and whole.electrodes.dtype == np.float64
    expected, found = recordings.prepare(whole), recordings.prepare(lean)
    for name in ("change", "rest", "drift", "electrodes", "quiet", "flags", "pdc"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert found.report == expected.report


def test_what_single_precision_rounds_is_kept_in_double(slide_lines, write, monkeypatch):
    blocks_of_20_kb(monkeypatch)
    slide_lines[600] = slide_lines[600][: slide_lines[600].rindex(",", 0, -1) + 1] + "3400.1,"
    path = write(slide_lines)
    np.testing.assert_array_equal(recordings.read(path, lean=True).electrodes, recordings.read(path).electrodes)


def test_a_lean_mapped_recording_holds_the_columns_of_its_map(slide_lines, write, monkeypatch):
    blocks_of_20_kb(monkeypatch)
    path = write(slide_lines)
    named = ColumnMap(tuple(f"ele{i}" for i in range(1, 20)), "timestamp", pdc="PDC")
    whole, lean = recordings.read(path, named), recordings.read(path, named, lean=True)
    np.testing.assert_array_equal(lean.electrodes, whole.electrodes)
    np.testing.assert_array_equal(lean.pdc, whole.pdc)
    with pytest.raises(TactileError, match="column 'touch' is missing"):
        recordings.read(path, replace(named, tac="touch"), lean=True)


def test_rest_that_drifts_is_found_without_a_copy_of_the_recording():
    electrodes, mask = np.zeros((20_000, 19), np.float32), np.zeros(20_000, bool)
    mask[:30] = mask[-30:] = True
    tracemalloc.start()
    rest = rest_level.baseline(electrodes, quiet.Quiet(mask, ((0, 30), (19_970, 20_000)), ""), drift=True)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 0.05 * electrodes.nbytes  # the levels of two parts; of every frame it would be twice the recording
    assert rest.at(np.arange(len(electrodes))).shape == electrodes.shape
