"""A force measured beside a recording: what is read, and what is refused in words."""

import h5py
import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.force_file import read_force

FRAMES, START = 300, 1.6e9
SIZE = 2 + np.sin(np.arange(FRAMES) / 20)  # N
AXES = np.outer(SIZE, [0.6, 0, -0.8])


def recording(path="touch.csv", start=START):
    """A recording of 3 s; what its electrodes read is of no matter here."""
    electrodes = 3000.0 + np.arange(19) + np.arange(FRAMES)[:, None] % 7
    return assemble(str(path), "text", electrodes=electrodes, stamps=start + np.arange(FRAMES) / 100)


def written(tmp_path, columns, header=""):
    np.savetxt(tmp_path / "force.csv", columns, delimiter=",", header=header, comments="", fmt="%.9f")
    return str(tmp_path / "force.csv")


@pytest.mark.parametrize("columns", [SIZE, -SIZE, AXES])
def test_a_file_of_as_many_rows_needs_no_time(columns, tmp_path):
    time, size = read_force(written(tmp_path, columns), recording())
    np.testing.assert_allclose(size, SIZE, atol=1e-6)
    np.testing.assert_allclose(time, np.arange(FRAMES) / 100, atol=1e-6)


@pytest.mark.parametrize(("start", "known"), [(START, START), (START + 0.5, START), (0.0, START), (START, 0.0)])
def test_a_clock_of_its_own_places_it_beside_the_recording(start, known, tmp_path):
    """Unix time on both sides; else both begin at once."""
    time = np.arange(0, 4, 0.004)
    found = read_force(written(tmp_path, np.column_stack([start + time, 1 + time]), "stamp,N"), recording(start=known))
    offset = start - known if start and known else 0.0
    np.testing.assert_allclose(found[0], offset + time, atol=1e-6)
    np.testing.assert_allclose(found[1], 1 + time, atol=1e-6)


@pytest.mark.parametrize("names", ["fx,fy,fz", "FX, fy, fz", "size"])
def test_columns_of_the_recording_s_own_file_are_a_force(names, tmp_path):
    path = tmp_path / "touch.csv"
    np.savetxt(path, np.column_stack([AXES, SIZE]), delimiter=",", header="fx,fy,fz,size", comments="")
    np.testing.assert_allclose(read_force(names, recording(path))[1], SIZE, atol=1e-6)


def test_an_array_of_the_recording_s_own_file_is_a_force(tmp_path):
    with h5py.File(tmp_path / "touch.h5", "w") as file:
        file["truth/force"] = AXES
    np.testing.assert_allclose(read_force("truth/force", recording(tmp_path / "touch.h5"))[1], SIZE, atol=1e-6)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (SIZE[:-1], "299 rows; expected 300, as many as frames"),
        (np.tile(AXES, 2), "6 columns; expected N in one column or three"),
        (1000 * SIZE, "cannot be a finger's force in newtons"),
        (np.zeros(FRAMES), "0 to 0, which cannot be a finger's force"),
        (np.where(np.arange(FRAMES) == 7, np.nan, SIZE), "no number in row 8"),
        (np.column_stack([START + 3600 + np.arange(FRAMES), SIZE]), "0% of its frames; expected at least 50%"),
        (np.column_stack([np.arange(3000), np.tile(SIZE, 10)]), "2,999 s if it is in seconds, .* in milliseconds"),
        (np.column_stack([SIZE, SIZE]), "numbers that do not rise; expected the time"),
    ],
)
def test_what_is_no_force_beside_the_recording_is_refused(columns, said, tmp_path):
    with pytest.raises(TactileError, match=said):
        read_force(written(tmp_path, columns), recording())


@pytest.mark.parametrize("header", ["force,time", "time,fx,fy"])
def test_a_time_that_would_be_taken_for_a_force_is_refused(header, tmp_path):
    columns = np.column_stack([SIZE] * (header.count(",") + 1))
    with pytest.raises(TactileError, match="the time in column 'time'; expected N in one column or three"):
        read_force(written(tmp_path, columns, header), recording())


@pytest.mark.parametrize("unit", ["[lbf]", "(kg)", "_ozf", "_gf"])
def test_a_column_named_after_another_unit_is_refused(unit, tmp_path):
    with pytest.raises(TactileError, match=r"a column 'force.*'; expected newtons"):
        read_force(written(tmp_path, SIZE, f"force{unit}"), recording())
    assert len(read_force(written(tmp_path, AXES, "fx [N],fy_n,force_g"), recording())[1]) == FRAMES  # g: its frame's


@pytest.mark.parametrize(
    ("named", "content", "said"),
    [
        ("force.csv", "", "an empty file"),
        ("nothere.csv", None, "neither a file nor columns of"),
        ("touch.csv", "PK\x03\x04 no archive", "a packed file"),
    ],
)
def test_other_files_are_refused(named, content, said, tmp_path):
    (tmp_path / "own.csv").write_text("a,b\n1,2\n")
    if content is not None:
        (tmp_path / named).write_text(content)
    with pytest.raises(TactileError, match=said):
        read_force(str(tmp_path / named), recording(tmp_path / "own.csv"))
