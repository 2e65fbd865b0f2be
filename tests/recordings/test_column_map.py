"""A CSV file with names of its own: the map is guessed, read again, and refused in words where it is wrong."""

import json

import numpy as np
import pytest
from conftest import SLIDE_HEADER

from tactile_core import recordings
from tactile_core.cli.main import main
from tactile_core.recordings import chunks
from tactile_core.recordings.tables import column_map
from tactile_core.recordings.tables.map_guess import guess

pytestmark = pytest.mark.usefixtures("no_sheet")

FRAMES = 120


@pytest.fixture
def own(tmp_path):
    """A file of own names, times in ms, and the same recording in a known layout."""
    random = np.random.default_rng(1)
    counts = 3300 + random.integers(-1, 2, (FRAMES, 19))
    counts[60:90, 7] -= 100
    time = np.arange(FRAMES)
    own = tmp_path / "own.csv"
    names = ["Time (ms)", *(f"Elec {i:02d}" for i in range(19)), "PDC raw"]
    rows = np.column_stack([10 * time, counts, np.full(FRAMES, 1800)])
    np.savetxt(own, rows, fmt="%d", delimiter=";", header=";".join(names), comments="")
    known = np.full((FRAMES, len(SLIDE_HEADER)), 1800.0)
    known[:, 0], known[:, 26:] = time / 100, counts
    np.savetxt(tmp_path / "known.csv", known, fmt="%.10g", delimiter=",", header=",".join(SLIDE_HEADER), comments="")
    return own


def test_info_writes_a_map_by_which_the_file_is_the_same_recording(own, tmp_path, capsys):
    map_file = tmp_path / "map.toml"
    assert main(["info", str(own)]) == 2
    assert "tactile info FILE --columns" in capsys.readouterr().err
    assert main(["info", str(own), "--columns", str(map_file)]) == 0
    columns = column_map.read(map_file)
    assert (columns.time, columns.time_unit, columns.pdc, columns.tac) == ("time (ms)", "ms", "pdc raw", "")
    assert columns.electrodes == tuple(f"elec {i:02d}" for i in range(19))
    mapped, known = recordings.read(own, columns), recordings.read(tmp_path / "known.csv")
    for name in ("time", "electrodes", "pdc"):
        np.testing.assert_allclose(getattr(mapped, name), getattr(known, name), atol=1e-9)
    np.testing.assert_array_equal(recordings.read(own, map_file).electrodes, mapped.electrodes)  # the map by its name
    parts = list(chunks.read_parts(own, columns))
    assert len(parts) == 1 and np.array_equal(parts[0].recording.electrodes, known.electrodes)


def test_channels_go_with_electrodes_whose_names_end_alike():
    names = [f"e{i}_{side}" for side in ("right", "left") for i in range(1, 20)]
    found = guess(["time", "pdc_left", "pdc_right", *names])
    assert [(each.electrodes[0], each.pdc) for each in found] == [("e1_right", "pdc_right"), ("e1_left", "pdc_left")]


def test_a_map_leads_through_convert_and_batch(own, tmp_path):
    map_file = tmp_path / "map.toml"
    assert main(["info", str(own), "--columns", str(map_file)]) == 0
    words = [str(own), "--columns", str(map_file), "--keep", "latent"]
    assert main(["convert", *words, "--out", str(tmp_path / "out")]) == 0
    note = json.loads((tmp_path / "out" / "own" / "note.json").read_text(encoding="utf-8"))
    assert note["options"]["prepare"]["columns"]["pdc"] == "pdc raw"
    assert main(["batch", *words, "--out", str(tmp_path / "job")]) == 0
    assert list((tmp_path / "job" / "shards").rglob("*.h5"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"elec 03"', '"elec 99"', "column 'elec 99'"),
        ('"elec 03"', '"elec 04"', "18 different"),
        ('"elec 03", ', "", "18 names"),
        ('pdc = "pdc raw"', 'pdc = "elec 03"', "named twice"),
        ('time_unit = "ms"', 'time_unit = "hours"', "time_unit"),
        ("pdc = ", "presure = ", "presure"),
        (column_map.FORMAT, "other", "format"),
    ],
)
def test_a_wrong_map_is_refused_in_words(own, tmp_path, old, new, words, capsys):
    map_file = tmp_path / "map.toml"
    assert main(["info", str(own), "--columns", str(map_file)]) == 0
    text = map_file.read_text(encoding="utf-8")
    assert old in text
    map_file.write_text(text.replace(old, new), encoding="utf-8")
    assert main(["info", str(own), "--columns", str(map_file)]) == 2
    assert words in capsys.readouterr().err


def test_names_from_a_stranger_stay_in_their_comment(own, tmp_path):
    text = own.read_text(encoding="utf-8").replace("PDC raw", "x\x1b\u2028=1]")
    own.write_text(text, encoding="utf-8")
    map_file = tmp_path / "map.toml"
    held = tuple(text.splitlines()[0].lower().split(";"))
    columns = guess(held)[0]
    column_map.write(map_file, [columns], held)
    assert column_map.read(map_file) == columns
