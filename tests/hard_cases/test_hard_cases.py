"""Every quick hard case by its name, with what is expected of it; the slow ones run in ``benchmarks/hard_cases.py``."""

import pytest

pytest.importorskip("scipy", reason="extra [fem] is not installed")

from gel_pictures import NO_MITSUBA

from hard_cases import CASES, HARD
from hard_cases.case import MITSUBA, Case, Found
from tactile_core.accuracy import line


@pytest.mark.parametrize("case", [case for case in CASES if not case.slow], ids=lambda case: case.name)
def test_converges_within_the_stated_error_or_says_that_it_cannot(case):
    if case.stage == MITSUBA:
        pytest.importorskip("mitsuba", reason=NO_MITSUBA)
    row = case.row()
    assert row["ok"], f"{line(row)} {row['words']}; expected: {case.expected}"


def test_every_hard_case_is_in_the_table_and_names_are_of_one_case_each():
    assert {case.hard for case in CASES} == {*HARD}
    assert len({case.name for case in CASES}) == len(CASES)


def test_a_case_that_breaks_a_law_fails_whatever_its_figure():
    row = Case("broken", "", "", "", lambda: Found(0.0, "um", 1.0, broken=("a node is pulled",))).row()
    assert row["ok"] is False and "pulled" in row["words"]
