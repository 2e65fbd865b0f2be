"""The rows that hold the gap law against the sheet say what they should of readings that are known."""

import numpy as np
import pytest
from benchmarks.mechanics.electrode_law import _law_rows

from tactile_core.mechanics.electrodes.gap_law import FILM_CONSTANT, signal_of_gaps
from tactile_core.mechanics.fast.sensing_points import electrode_feet

GAPS = electrode_feet().gap * np.random.default_rng(0).uniform(0.3, 1.1, (40, 19))


def rows(change: np.ndarray, *, each: bool = False) -> dict[str, dict]:
    return {found["name"]: found for found in _law_rows(change, GAPS, "made up", each=each)}


def test_a_sheet_that_obeys_the_law_differs_in_nothing_but_its_scale():
    found = rows(7.3 * signal_of_gaps(GAPS))
    assert found["gap_law_difference"]["value"] < 1e-9 and found["gap_law_difference"]["baseline"] > 10
    assert found["gap_law_correlation"]["value"] == pytest.approx(1)


def test_constants_of_single_electrodes_are_found_relative_to_the_one():
    own = np.where(np.arange(19) < 9, 0.5, 1.5)
    found = rows(own * signal_of_gaps(GAPS), each=True)
    constants = np.array([found[f"gap_law_E{e + 1:02d}_own_constant"]["value"] for e in range(19)])
    np.testing.assert_allclose(constants / constants[0], own / own[0], rtol=1e-3)  # rows hold four digits
    assert 0.5 * FILM_CONSTANT < constants.mean() < 1.5 * FILM_CONSTANT
    assert found["gap_law_difference_own_constants"]["value"] < 1e-9 < found["gap_law_difference"]["value"]


def test_readings_that_know_nothing_of_the_gaps_do_not_correlate():
    noise = (
        np.random.default_rng(1).standard_normal(GAPS.shape) + 0.1 * signal_of_gaps(GAPS) / signal_of_gaps(GAPS).std()
    )
    found = rows(noise)
    assert abs(found["gap_law_correlation"]["value"]) < 0.25  # 760 independent pairs with a true one of 0.1
