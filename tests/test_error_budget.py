"""Bounds as they are written, and the cheapest way that meets one."""

from __future__ import annotations

import pytest

from tactile_core.error_budget import Budget, Candidate, cheapest, parse
from tactile_core.errors import TactileError

WAYS = [Candidate("rough", 20.0, 1.0), Candidate("fine", 5.0, 100.0), Candidate("odd", 4.0, 90.0)]


@pytest.mark.parametrize(
    ("text", "budget"),
    [
        ("5um", Budget(um=5)), ("0.6levels", Budget(levels=0.6)), ("1level", Budget(levels=1)),
        (" 5 µm ", Budget(um=5)), (".5UM,2levels", Budget(0.5, 2)), ("2levels, 1e-1um", Budget(0.1, 2)),
    ],
)  # fmt: skip
def test_a_bound_is_a_number_and_its_unit(text, budget):
    assert parse(text) == budget


@pytest.mark.parametrize(
    "text",
    ["", "5", "um", "5mm", "-5um", "0um", "0levels", "nanum", "infum", "1e999um", "5um,6um", "5um,", "5 6um"],
)
def test_anything_else_is_refused(text):
    with pytest.raises(TactileError, match=r"such as 5um or 0\.6levels"):
        parse(text)


def test_a_unit_that_means_nothing_here_is_refused():
    assert parse("5um").only("um", "why") == 5
    with pytest.raises(TactileError, match=r"2levels.*um.*Drawn elsewhere"):
        parse("5um,2levels").only("um", "Drawn elsewhere")


@pytest.mark.parametrize(("bound", "name"), [(30, "rough"), (20, "rough"), (19.9, "odd"), (4, "odd")])
def test_the_cheapest_that_meets_a_bound_is_picked(bound, name):
    assert cheapest(WAYS, bound, "um").name == name


def test_a_bound_that_none_meets_names_the_best():
    with pytest.raises(TactileError, match=r"3 um of shape; expected 4 or more, which odd has"):
        cheapest(WAYS, 3, "um", "shape")
