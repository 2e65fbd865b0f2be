"""What is wrong with a file is said with its line and field; a bad frame is repaired, a bad file refused."""

import io
import os
import stat
import zipfile

import h5py
import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.tables.table import read_table


def repaired(recording):
    return np.flatnonzero(recording.flags & Flag.REPAIRED).tolist()


def test_truncated_last_row_is_a_flagged_frame(press, slide_lines, write):
    slide_lines[-1] = slide_lines[-1][: len(slide_lines[-1]) // 2]
    recording = recordings.read(write(slide_lines, end=""))
    assert len(recording) == len(press.time) and repaired(recording) == [len(press.time) - 1]
    assert f"line {len(slide_lines)}, row: ends after" in recording.warnings[0]
    signals = recordings.prepare(recording)
    assert np.isfinite(signals.change).all() and signals.report["rows_repaired"] == [len(slide_lines)]


def test_a_number_cut_off_in_the_last_cell_is_not_believed(press, slide_lines, write):
    recording = recordings.read(write([*slide_lines[:-1], slide_lines[-1][:-3]], end=""))
    assert np.isnan(recording.electrodes[-1, 18]) and np.isfinite(recording.electrodes[-1, :18]).all()
    assert "ele19" in recording.warnings[0] and "truncated" in recording.warnings[0]


@pytest.mark.parametrize(("cut", "doubted"), [(0, False), (1, True), (2, True), (3, True)])
def test_without_closing_separators_a_number_far_below_those_before_is_doubted(cut, doubted, slide_lines, write):
    lines = [line.rstrip(",") for line in slide_lines]
    recording = recordings.read(write([*lines[:-1], lines[-1][: len(lines[-1]) - cut]], end=""))
    assert np.isnan(recording.electrodes[-1, 18]) == doubted
    assert repaired(recording) == [len(recording) - 1] * doubted
    assert len(recording.warnings) == doubted
    if doubted:
        assert f"line {len(lines)}, ele19: the file ends in this cell" in recording.warnings[0]


def test_a_last_value_near_zero_is_believed_in_a_signal_that_swings_around_it(slide_lines, write):
    swing = np.rint(40 * np.sin(np.arange(60.0)))
    swing[-1] = np.rint(0.25 * swing[-2])
    lines = slide_lines[:1]
    for i, value in enumerate(swing):
        lines.append(f"{1.58e9 + i / 100:.2f}," + "2000," * (lines[0].count(",") - 1) + f"{value:g}")
    assert recordings.read(write(lines, end="")).warnings == ()


@pytest.mark.parametrize("cell", ["oops", "nan", "", "inf", "1_0", "9e99"])
def test_a_bad_cell_is_one_flagged_frame_named_by_line_and_field(cell, press, slide_lines, write):
    cells = slide_lines[40].split(",")
    cells[26 + 2] = cell
    slide_lines[40] = ",".join(cells)
    recording = recordings.read(write(slide_lines))
    assert repaired(recording) == [39] and np.argwhere(np.isnan(recording.electrodes)).tolist() == [[39, 2]]
    assert len(recording.warnings) == 1 and recording.warnings[0].startswith("line 41, ele3: ")
    expected = 0.5 * (press.electrodes[38, 2] + press.electrodes[40, 2])
    assert recordings.prepare(recording).electrodes[39, 2] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("cell", "found"),
    [
        ('"2000,5"', "'2000,5' is a number with a decimal comma, where a point is expected"),
        ('"2,000"', "'2,000' is a number with thousands separators or a decimal comma"),
        ("2 000", "'2 000' is a number with thousands separators"),
        ("2'000", '"2\'000" is a number with thousands separators'),
        ("2,000", r"row: .* cells where the header has .* \(commas within numbers\?\); .* rows are bad"),
    ],
)
def test_commas_in_numbers_are_named_where_commas_separate(cell, found, slide_lines, write):
    lines = [slide_lines[0], *(line.replace(",2000,", f",{cell},", 1) for line in slide_lines[1:])]
    with pytest.raises(TactileError, match=f"line 2, .*{found}"):
        recordings.read(write(lines))


def test_a_quoted_comma_in_one_row_is_named(slide_lines, write):
    slide_lines[40] = slide_lines[40].replace(",2000,", ',"2000,5",', 1)
    assert "line 41, tac: '2000,5' is a number with a decimal comma" in recordings.read(write(slide_lines)).warnings[0]


def test_a_row_with_too_many_cells_is_not_believed(slide_lines, write):
    slide_lines[10] = "7," + slide_lines[10] + "8"
    recording = recordings.read(write(slide_lines))
    assert repaired(recording) == [9] and np.isnan(recording.electrodes[9]).all()
    assert recording.time[9] == pytest.approx(0.09, abs=1e-6) and "line 11" in recording.warnings[0]


def test_a_bad_cell_outside_the_electrodes_keeps_them(press, slide_lines, write):
    cells = slide_lines[40].split(",")
    cells[10] = "?"
    slide_lines[40] = ",".join(cells)
    recording = recordings.read(write(slide_lines))
    np.testing.assert_array_equal(recording.electrodes, press.electrodes)
    assert repaired(recording) == [39] and "left empty" in recording.warnings[0] and np.isnan(recording.pac[39, 6])


def test_blank_lines_are_no_frames_and_keep_the_numbering(slide_lines, write):
    recording = recordings.read(write([*slide_lines[:5], "", *slide_lines[5:]]))
    assert recording.rows[:6].tolist() == [2, 3, 4, 5, 7, 8]
    assert recording.warnings == ("line 6: blank, a comment or the header again; no frame is made of it",)


def test_blank_lines_in_place_of_frames_are_told_and_those_at_the_end_are_not(slide_lines, write):
    for line in range(20, 30):
        slide_lines[line] = " "
    reported = recordings.read(write([*slide_lines, "", ""])).warnings
    assert reported[0].startswith("lines 21, 22, 23, 24, 25, 26, 27, 28 …: blank, comments or the header again (10 in ")
    assert not any("blank" in warning for warning in reported[1:])


def test_a_header_of_another_order_within_the_rows_is_refused(slide_lines, write):
    other = slide_lines[0].replace("ele2,ele3", "ele3,ele2")
    with pytest.raises(TactileError, match="line 6: another header"):
        recordings.read(write([*slide_lines[:5], other, *slide_lines[5:]]))


def test_too_many_bad_rows_are_an_error(slide_lines, write):
    bad = [line if i % 4 or i == 0 else line.replace(",", ",x", 28) for i, line in enumerate(slide_lines)]
    with pytest.raises(TactileError, match=r"line 5, .*175 of 700 rows are bad; expected at most 20%"):
        recordings.read(write(bad))


@pytest.mark.parametrize("missing", ["timestamp", "pdc", "pac22"])
def test_a_missing_column_is_named(missing, slide_lines, write):
    place = slide_lines[0].split(",").index(missing)
    lines = [",".join(cell for i, cell in enumerate(line.split(",")) if i != place) for line in slide_lines]
    with pytest.raises(TactileError, match=f"line 1: column '{missing}' is missing.*--columns"):
        recordings.read(write(lines))


@pytest.mark.parametrize(("to", "from_"), [("ele{}", 0), ("ele{:02d}", 1)])
def test_electrodes_counted_otherwise_are_not_taken_for_others(to, from_, slide_lines, write):
    header, *rows = slide_lines
    for i in range(1, 20):
        header = header.replace(f",ele{i}", f",{to.format(i - 1 + from_)}x", 1)
    path = write([header.replace("x,", ",").rstrip("x"), *rows])
    with pytest.raises(TactileError, match=r"column 'ele0\d?' and no 'ele\d+'; expected ele1 .. ele19. Name its"):
        recordings.read(path)


def test_stamps_that_go_back_or_leave_a_gap_are_flagged_and_kept(press, make, in_layout):
    press.time[100:] -= 0.5
    press.time[300:] += 0.03
    recording = recordings.read(in_layout("csv_slide", press))
    assert np.flatnonzero(recording.flags & Flag.TIME_JUMP).tolist() == [100, 300]
    np.testing.assert_allclose(recording.time, press.time, atol=1e-6)  # as in the file, not sorted
    np.testing.assert_array_equal(recording.electrodes, press.electrodes)
    assert "before line 102 (-490.0 ms)" in recording.warnings[0] and "gap" in recording.warnings[1]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "an empty file"),
        (b"\n \n", "an empty file"),
        (b'"', "an empty file"),
        (b"\0\1\2\3" * 50, "byte 0: binary data"),
        ("zeit,kraft\n1,2\n".encode("utf-16"), "UTF-16"),
        (b"caf\xe9,b\n1,2\n", "byte 3: not UTF-8"),
        (b"hello world\n", "no known recording: columns 'hello, world'"),
        (b"1,2,3\n4,5,6\n", "line 1: numbers where the column names"),
        (b"a,a\n1,2\n", "column 'a' is there twice; expected each column once. Rename or remove"),
        (b"\x89HDF\r\n\x1a\n" + b"x" * 99, "damaged HDF5"),
        (b"PK\x03\x04" + b"x" * 99 + b".npy", "damaged NPZ"),
    ],
)
def test_what_is_no_recording_is_refused_in_one_sentence(content, message, tmp_path):
    path = tmp_path / "thing.csv"
    path.write_bytes(content)
    with pytest.raises(TactileError, match=message) as caught:
        recordings.read(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_header_alone_is_refused(slide_lines, write):
    with pytest.raises(TactileError, match="a header without data rows"):
        recordings.read(write(slide_lines[:1]))


def test_folder_missing_file_and_locked_file(tmp_path, slide_lines, write):
    with pytest.raises(TactileError, match="a folder"):
        recordings.read(tmp_path)
    with pytest.raises(TactileError, match=r"there is no such file.*tactile scenes copy"):
        recordings.read(tmp_path / "absent.csv")
    path = write(slide_lines)
    os.chmod(path, 0)
    try:
        if os.access(path, os.R_OK):
            pytest.skip("this user reads files without permission (root)")
        with pytest.raises(TactileError, match="Permission denied"):
            recordings.read(path)
    finally:
        os.chmod(path, stat.S_IRUSR | stat.S_IWUSR)


def test_a_result_of_the_toolkit_is_named(tmp_path):
    with h5py.File(tmp_path / "frames.h5", "w") as file:
        file.attrs["format"] = "tactile-frames-1"
    with pytest.raises(TactileError, match=r"a result of this toolkit, format=tactile-frames-1.*`tactile render`"):
        recordings.read(tmp_path / "frames.h5")


def test_names_that_are_no_text_are_told(press, in_layout):
    path = in_layout("hdf5_electrode_vals", press)
    with open(path, "rb+") as file:
        data = file.read()
        file.seek(data.index(b"electrode_vals"))
        file.write(b"e\x80")
    with pytest.raises(TactileError, match="no known recording: arrays"):
        recordings.read(path)


def test_arrays_that_disagree_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", electrodes=np.zeros((5, 19)), time=np.zeros(4))
    with pytest.raises(TactileError, match=r"time: shape \(4,\); expected \(5\)"):
        recordings.read(tmp_path / "a.npz")


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_array_that_is_there_twice_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        for value in (3000, 2000):
            content = io.BytesIO()
            np.save(content, np.full((5, 19), value))
            archive.writestr("electrodes.npy", content.getvalue())
    with pytest.raises(TactileError, match=r"electrodes\.npy: there twice"):
        recordings.read(tmp_path / "a.npz")


def test_pickles_are_never_loaded(tmp_path):
    np.savez(tmp_path / "a.npz", electrodes=np.array([{"a": 1}], dtype=object))
    with pytest.raises(TactileError, match="values of type object"):
        recordings.read(tmp_path / "a.npz")


def test_nan_in_arrays_is_a_flagged_frame(press, tmp_path):
    press.electrodes[17, 3] = np.nan
    np.savez(tmp_path / "a.npz", electrodes=press.electrodes, time=press.time)
    recording = recordings.read(tmp_path / "a.npz")
    assert repaired(recording) == [17] and recording.warnings[0].startswith("frame 17, E4: ")


@pytest.mark.parametrize(
    "cell", ["7", " +2e-3 ", "-0", "1e400", "nan", "1_0", "", "\u0661", "1 2", "#", "7,7", "7,", "7,,"]
)
def test_rows_of_clean_numbers_are_read_as_those_beside_a_bad_one(cell, tmp_path):
    rows = ["1,2,3", f"1,2,{cell}", "4,5,6"]  # the first makes it a column of numbers

    def read(lines):
        path = tmp_path / "rows.csv"
        path.write_text("\n".join(["a,b,c", *lines, ""]))
        with path.open("rb") as file:
            return read_table(os.fspath(path), file)

    alone, beside = read(rows), read([*rows, "1,x,2"])
    np.testing.assert_array_equal(alone.values, beside.values[:3])
    assert alone.problems == beside.problems[:-1]
