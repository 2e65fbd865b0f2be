"""Every quick hard case by its name, with what is expected of it; the slow ones run in ``benchmarks/hard_cases.py``."""

import pytest

pytest.importorskip("scipy", reason="extra [fem] is not installed")

from gel_pictures import NO_MITSUBA

from hard_cases.case import MITSUBA
from hard_cases.table import CASES, HARD, covered
from tactile_core.accuracy import line

QUICK = [case for case in CASES if not case.slow]


@pytest.mark.parametrize("case", QUICK, ids=lambda case: case.name)
def test_converges_within_the_stated_error_or_says_that_it_cannot(case):
    if case.stage == MITSUBA:
        pytest.importorskip("mitsuba", reason=NO_MITSUBA)
    row = case.row()
    if case.limit and not row["ok"]:
        pytest.xfail(case.limit)
    assert row["ok"], f"{line(row)} {row['words']}; expected: {case.expected}"


def test_every_hard_case_of_the_issue_is_in_the_table():
    assert set(HARD) <= covered()


def test_names_are_of_one_case_each():
    names = [case.name for case in CASES]
    assert len(names) == len(set(names))


def test_a_case_that_breaks_a_law_fails_whatever_its_figure():
    from hard_cases.case import Case, Found

    found = Found(0.0, "um", 1.0, broken=("a node is pulled",))
    row = Case("broken", "", "", "", lambda: found).row()
    assert row["ok"] is False and "pulled" in row["words"]
