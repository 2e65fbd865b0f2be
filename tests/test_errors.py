"""The error type: one sentence, and the same one after a trip between processes."""

import copy
import math

import pytest

from tactile_core.errors import TactileError, finite_number


def test_sentence_names_where_found_expected_and_advice():
    error = TactileError("touch.csv, row 3", "'abc'", "a number", "Correct the cell")
    assert str(error) == "touch.csv, row 3: 'abc'; expected a number. Correct the cell"
    assert str(TactileError("touch.csv", "empty")) == "touch.csv: empty"


def test_it_survives_being_handed_over():
    error = TactileError("a", "b", "c", "d")
    again = copy.copy(error)  # goes through __reduce__, as between worker processes
    assert str(again) == str(error) and again.advice == "d"


def test_a_message_quotes_a_long_finding_in_part():
    error = TactileError("cube.off", "begins" + 5000 * "x" + "ends", "a triangle mesh", "Export it again")
    assert "begins" in str(error) and "ends; expected a triangle mesh. Export it again" in str(error)
    assert len(str(error)) < 1000
    assert len(error.found) == 5010


@pytest.mark.parametrize("value", [None, "1", b"1", True, 10**400, [1, 2], math.nan, 3, -1])
def test_what_is_no_number_of_a_range_is_refused(value):
    with pytest.raises(TactileError, match=r"Gel, force: .*; expected 0 to 2 N. Lift it"):
        finite_number(value, "Gel, force", "0 to 2 N", 0.0, 2.0, "Lift it")
    assert finite_number(2, "Gel, force", "0 to 2 N", 0.0, 2.0) == 2.0
    with pytest.raises(TactileError, match="Gel, force: inf; expected any"):
        finite_number(math.inf, "Gel, force", "any")
