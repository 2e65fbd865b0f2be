"""Each metric against a case that can be worked out by hand."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactile_core import accuracy
from tactile_core.accuracy import Candidate, cheapest
from tactile_core.errors import TactileError
from tactile_core.files import atomic

REST = np.array([[x * 1e-3, -8e-3, z * 1e-3] for x in range(5) for z in range(4)])
WAYS = [Candidate("rough", 20.0, 1.0), Candidate("fine", 5.0, 100.0), Candidate("odd", 4.0, 90.0)]


def dent(depth: float, node: int) -> np.ndarray:
    """(1, 20, 3) m, one node pushed in."""
    displacement = np.zeros((1, len(REST), 3), np.float32)
    displacement[0, node, 1] = depth
    return displacement


def test_perfect_answer_has_no_error():
    true = dent(1e-3, 7)
    for value in accuracy.mesh_metrics(true, true).values():
        assert value == [0.0]


def test_rms_counts_moving_nodes_only():
    true, found = dent(100e-6, 3), dent(60e-6, 3)
    true[0, 4, 0] = 20e-6  # moves, and the answer misses it
    found[0, 5, 2] = 500e-6  # rests in truth: not in the contact, but the largest error
    expected = np.sqrt((40e-6**2 + 20e-6**2) / 2)
    assert accuracy.rms_in_contact(found, true) == pytest.approx([expected], rel=1e-6)  # float32 input
    assert accuracy.max_error(found, true) == pytest.approx([500e-6], rel=1e-6)


def test_core_is_above_a_share_of_the_peak():
    true = dent(100e-6, 3)
    true[0, [4, 5], 1] = 31e-6, 29e-6
    found = true.copy()
    found[0, [3, 4, 5], 1] += np.float32([-10e-6, 20e-6, 90e-6])
    assert accuracy.core_height_error(found, true) == pytest.approx([np.sqrt((10e-6**2 + 20e-6**2) / 2)], rel=1e-5)
    assert accuracy.peak_depth_error(found, true) == pytest.approx([0.19], rel=1e-5)  # the new peak is node 5, 119 um


def test_no_contact_is_no_figure():
    still = np.zeros((1, len(REST), 3), np.float32)
    assert np.isnan(accuracy.rms_in_contact(still, still)).all()
    assert np.isnan(accuracy.core_height_error(still, still)).all()
    assert np.isnan(accuracy.peak_depth_error(still, still)).all()
    assert np.isnan(accuracy.dent_center(still, REST)).all()
    assert accuracy.mean(np.array([np.nan])) is None


def test_depth_on_a_curved_pad_is_the_length():
    true = np.zeros((1, len(REST), 3), np.float32)
    true[0, 2] = 0.0, 30e-6, 40e-6
    assert accuracy.peak_depth_error(0.5 * true, true, accuracy.lengths) == pytest.approx([0.5])


def test_center_of_a_dent():
    displacement = dent(1e-3, 0) + dent(1e-3, 1) + dent(0.2e-3, 19)  # the last is below 30 % of the peak
    assert accuracy.dent_center(displacement, REST)[0] == pytest.approx([0.0, 0.5e-3])


@pytest.mark.parametrize(("bound", "name"), [(30, "rough"), (20, "rough"), (19.9, "odd"), (4, "odd")])
def test_the_cheapest_that_meets_a_bound_is_picked(bound, name):
    assert cheapest(WAYS, bound, "um").name == name


def test_a_bound_that_none_meets_names_the_best():
    with pytest.raises(TactileError, match=r"3 um of shape; expected 4 or more, which odd has"):
        cheapest(WAYS, 3, "um", "shape")


def test_a_row_of_what_was_not_measured_is_json_and_misses_its_target(tmp_path: Path) -> None:
    made = accuracy.row("place", float("nan"), "mm", 1.0, baseline=float("nan"))
    atomic.write_json(tmp_path / "rows.json", [made])
    assert json.loads((tmp_path / "rows.json").read_text()) == [made]
    assert made["value"] is None and made["baseline"] is None and made["ok"] is False
