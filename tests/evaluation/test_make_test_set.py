"""The script that makes the test set: solved presses become one file, and what was lost is told."""

import json
import runpy
from pathlib import Path

import h5py
import numpy as np
import pytest

from tactile_core.batch import pack
from tactile_core.mechanics.pair_file import DATASETS, SCALE
from tactile_core.paired_contacts import read_pairs

ROOT = Path(__file__).parent.parent.parent
SHIPPED = ROOT / "scenes" / "training" / "test_contacts.h5"


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(ROOT / "scripts" / "make_test_set.py"))


def solved(folder: Path, script: dict, number: int) -> None:
    """A press of the shipped set, as the script keeps one that it has solved."""
    with h5py.File(SHIPPED) as file:
        rows = np.flatnonzero(file["press"][:] == number)
        columns = {name: file[name][rows] for name in DATASETS}
        for name in ("displacement_biotac", "displacement_digit"):
            columns[name] = (columns[name] * round(file[name].attrs["scale"] / SCALE)).astype(np.int16)
    told = {"wanted": np.int32(3), "lost": np.zeros(0, np.uint8), "count": np.int32(len(rows))}
    pack.write(script["file_of"](folder, 1, number), {**columns, **told})


def test_presses_are_merged_and_lost_ones_told(script, tmp_path):
    for number in (3, 5):
        solved(tmp_path, script, number)
    nothing = {"wanted": np.int32(4), "lost": np.frombuffer(b"no equilibrium", np.uint8), "count": np.int32(0)}
    pack.write(script["file_of"](tmp_path, 1, 4), nothing)
    told = script["merge"](tmp_path, 1, tmp_path / "set.h5")
    shipped, merged = read_pairs(SHIPPED), read_pairs(tmp_path / "set.h5")
    rows = np.flatnonzero(np.isin(shipped.press, (3, 5)))
    np.testing.assert_array_equal(merged.press, shipped.press[rows])
    np.testing.assert_array_equal(merged.displacement_digit, shipped.displacement_digit[rows])
    np.testing.assert_array_equal(merged.signal, shipped.signal[rows])
    assert told["contacts"] == len(rows) and told["contacts_wanted"] == 10 and told["presses_solved"] == 3
    assert told["lost"] == {"press_1_00004": "no equilibrium"}
    assert json.loads((tmp_path / "set.h5.card.json").read_text()) == told


def test_a_press_that_is_there_is_not_solved_again(script, tmp_path):
    solved(tmp_path, script, 3)
    before = script["file_of"](tmp_path, 1, 3).read_bytes()
    assert "was there" in script["solve_one"]((tmp_path, 1, 3))
    assert script["file_of"](tmp_path, 1, 3).read_bytes() == before
