"""Bounds on the toolkit's own error, as ``--error`` takes them."""

import pytest

from tactile_core.errors import TactileError
from tactile_core.jobs.error_budget import Budget, parse_budget


@pytest.mark.parametrize(
    ("text", "budget"),
    [
        ("5um", Budget(um=5)), ("0.6levels", Budget(levels=0.6)), ("1level", Budget(levels=1)),
        (" 5 µm ", Budget(um=5)), (".5UM,2levels", Budget(0.5, 2)), ("2levels, 1e-1um", Budget(0.1, 2)),
    ],
)  # fmt: skip
def test_a_bound_is_a_number_and_its_unit(text, budget):
    assert parse_budget(text) == budget


@pytest.mark.parametrize(
    "text", ["", "5", "um", "5mm", "-5um", "0um", "0levels", "nanum", "infum", "1e999um", "5um,6um", "5um,", "5 6um"]
)
def test_anything_else_is_refused(text):
    with pytest.raises(TactileError, match=r"such as 5um or 0\.6levels"):
        parse_budget(text)


def test_a_unit_that_means_nothing_here_is_refused():
    assert parse_budget("5um").only("um", "why") == 5
    with pytest.raises(TactileError, match=r"2levels.*um.*Drawn elsewhere"):
        parse_budget("5um,2levels").only("um", "Drawn elsewhere")
