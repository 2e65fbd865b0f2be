"""The presets' table and the choice by error."""

import pytest

from tactile_core.errors import TactileError
from tactile_core.pictures import presets
from tactile_core.pictures.mitsuba.variant import LLVM, SCALAR

TABLE = {"presets": {
    "fast": {"error": 1.2, "ms": {"numpy": 8}}, "standard": {"error": 1.1, "ms": {LLVM: 90, SCALAR: 600}},
    "quality": {"error": 0.6, "ms": {LLVM: 150, SCALAR: 900}},
    "reference": {"error": 0.05, "ms": {LLVM: 12e3}},
}}  # fmt: skip


@pytest.fixture
def table(monkeypatch):
    monkeypatch.setattr(presets, "measured", lambda: TABLE)


@pytest.mark.parametrize(("error", "name"), [(2.0, "fast"), (1.2, "fast"), (1.15, "standard"), (0.6, "quality")])
def test_the_cheapest_that_is_exact_enough_is_chosen(error, name, table):
    assert presets.cheapest(error, LLVM) == presets.cheapest(error, SCALAR) == name


def test_only_the_reference_is_exact(table):
    assert presets.cheapest(0.05, LLVM) == presets.cheapest(0.1, SCALAR) == "reference"
    with pytest.raises(TactileError, match=r"0.05 or more, which reference has"):
        presets.cheapest(0.01, LLVM)


def test_the_shipped_table_has_every_preset():
    for name in presets.NAMES:
        row = presets.measured()["presets"][name]
        assert row["error"] > 0 and row["ms"] and row["says"]
    # The reference's own row is the noise of its paths.
    errors = [presets.measured()["presets"][name]["error"] for name in ("fast", "standard", "quality")]
    assert errors == sorted(errors, reverse=True)
