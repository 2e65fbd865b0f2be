"""Recordings of a BioTac SP: described, never taken for those of a BioTac."""

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.recordings import PrepareOptions, info
from tactile_core.recordings.biotac_sp import read_sp
from tactile_core.recordings.column_map import ColumnMap

SLIP = [f"ff_e{number}" for number in range(1, 25)]
GRASP = [
    "object",
    "slipped",
    *(f"{finger}_biotac_{number}" for finger in ("ff", "mf", "th") for number in range(1, 25)),
]


@pytest.fixture
def counts():
    return np.random.default_rng(0).integers(2600, 3700, (30, 24))


def written(write, header, rows):
    return write([",".join(header), *(",".join(map(str, row)) for row in rows)])


def test_a_slip_recording_is_told_and_not_translated(counts, write, capsys):
    path = written(write, SLIP, counts)
    np.testing.assert_array_equal(read_sp(path).fingers["ff"], counts)
    assert main(["info", path]) == 0
    text = capsys.readouterr().out
    for part in (
        "BioTac SP, 24 electrodes a finger: first finger (ff)", "30 in lines 2 to 31", "0.30 s", "100 Hz (assumed)",
        "raw: whole numbers", "none are of a BioTac SP",
    ):  # fmt: skip
        assert part in text, part
    largest = next(line for line in text.splitlines() if "largest" in line).split()[1:]
    assert largest == [str(value) for value in counts.max(axis=0)]


def test_snapshots_of_a_grasp_name_their_fingers_and_labels(counts, write):
    path = written(write, GRASP, [["ball", 1, *row, *row, *row] for row in counts])
    text = info.describe(path)
    assert "thumb (th)" in text and "snapshots, one a line, labelled: object, slipped" in text
    assert "warnings" not in text and text.count("largest") == 3


def test_a_lost_cell_is_told_and_a_lost_column_refused(counts, write):
    rows = [[*map(str, row)] for row in counts]
    rows[4][7] = "?"
    path = written(write, SLIP, rows)
    assert np.isnan(read_sp(path).fingers["ff"][4, 7]) and "line 6, ff_e8" in info.describe(path)
    with pytest.raises(TactileError, match="'ff_e24' is missing"):
        read_sp(written(write, SLIP[:23], [row[:23] for row in rows]))
    dead = [[*row[:7], "", *row[8:]] for row in rows]
    with pytest.raises(TactileError, match="ff_e8: no reading in any line"):
        read_sp(written(write, SLIP, dead))


@pytest.mark.parametrize("stem", ["ff_e", "my_sensor_", "ele"])
def test_nineteen_of_its_columns_are_no_biotac(stem, counts, write):
    names = [f"{stem}{number}" for number in range(1, 25)]
    path = written(write, names, counts)
    columns = ColumnMap(electrodes=tuple(names[:19]))
    with pytest.raises(TactileError, match=r"24 electrodes: a BioTac SP, for which no weights ship"):
        recordings.read(path, columns)
    with pytest.raises(TactileError, match="for which no weights ship"):
        info.describe(path, PrepareOptions(columns=columns))


def test_public_recordings_are_described(outside_data):
    paths = sorted(outside_data("biotac_sp").glob("*/**/*.csv"))
    assert len(paths) > 30
    for path in paths:
        text = info.describe(path)
        assert "raw: whole numbers" in text and "none are of a BioTac SP" in text
