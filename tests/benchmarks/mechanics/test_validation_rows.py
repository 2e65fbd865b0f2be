"""Rows and report: what counts as missed, and what is written."""

import json
import shutil
from pathlib import Path

import pytest
import validate_mechanics
from benchmarks.measured_rows import read_table
from benchmarks.mechanics.golden import GOLDEN_FORCE

from tactile_core.accuracy import failed, line, order, row


def test_a_row_is_judged_by_its_size_or_from_below():
    assert row("error", -0.4, "percent", 0.5)["ok"] is True
    assert row("error", -0.6, "percent", 0.5)["ok"] is False
    assert row("error", float("nan"), "percent", 0.5)["ok"] is False
    assert row("order", 1.8, "1", 1.9, at_least=True)["ok"] is False
    assert row("order", 2.8, "1", 1.9, at_least=True)["ok"] is True
    assert row("time", 3.0, "s")["ok"] is None


def test_slow_is_no_failure():
    rows = [row("time", 3.0, "s", 1.0), row("memory", 3.0, "MB", 1.0), row("error", 3.0, "um", 1.0)]
    assert [found["name"] for found in failed(rows)] == ["error"]


def test_order_is_the_slope():
    sizes = [1.0, 0.5, 0.25]
    assert order(sizes, [7 * size**3 for size in sizes]) == pytest.approx(3, rel=1e-12)


def test_report_holds_every_row(tmp_path):
    forces = [row(f"golden_force_{depth * 1e3:.1f}mm_error", 0.1, "percent", 0.5) for depth in GOLDEN_FORCE]
    speed = [row("digit_fast_0.2mm_shape_rms", 3.0, "um", 2.0), row("digit_fast_0.2mm_time", 2.0, "ms")]
    speed.append(row("digit_full_0.2mm_shape_rms", float("nan"), "um", 2.0))
    page = Path(__file__).parents[3] / "docs" / "mechanics.md"
    shutil.copy(page, tmp_path)
    validate_mechanics.write(tmp_path / "mechanics.md", {"Golden": forces, "Speed": speed})
    text = (tmp_path / "mechanics.md").read_text(encoding="utf-8")
    table = read_table(tmp_path / "mechanics.csv")
    assert [each["name"] for each in table] == [each["name"] for each in forces + speed]
    assert {each["part"] for each in table} == {"Golden", "Speed"}
    assert [each["name"] for each in table if each["ok"] == "False"] == [
        "digit_fast_0.2mm_shape_rms",
        "digit_full_0.2mm_shape_rms",
    ]
    words = "`digit_fast_0.2mm_shape_rms` 3 um, `digit_full_0.2mm_shape_rms` - um"
    assert f"| Speed | 3 | 2 | {words} |" in text and "scikit-fem" not in text
    words = [line for line in page.read_text(encoding="utf-8").splitlines() if not line.startswith("|")]
    assert [line for line in text.splitlines() if not line.startswith("|")] == words


def test_script_writes_its_rows_and_says_what_missed(monkeypatch, tmp_path, capsys):
    good, bad, slow = row("a", 0.1, "1", 1.0), row("b", 2.0, "1", 1.0), row("c", 2.0, "s", 1.0)
    monkeypatch.setattr(
        validate_mechanics, "CHECKS", {"good": (lambda quick: [good, slow], ""), "bad": (lambda quick: [bad], "")}
    )
    assert validate_mechanics.main(["--quick", "--only", "good", "--json", str(tmp_path / "rows.json")]) == 0
    assert json.loads((tmp_path / "rows.json").read_text()) == [good, slow]
    assert validate_mechanics.main(["--quick"]) == 1
    said = capsys.readouterr()
    assert "MISSED: b = 2.0 1, target 1.0" in said.err and line(bad) in said.out


def test_a_check_that_breaks_off_is_a_miss_and_the_others_go_on(monkeypatch, tmp_path, capsys):
    good = row("a", 0.1, "1", 1.0)

    def broken(quick):
        yield good
        raise ArithmeticError("no equilibrium")

    monkeypatch.setattr(validate_mechanics, "CHECKS", {"broken": (broken, ""), "good": (lambda quick: [good], "")})
    assert validate_mechanics.main(["--quick", "--json", str(tmp_path / "rows.json")]) == 1
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [found["name"] for found in rows] == ["a", "broken_completed", "a"]
    assert "no equilibrium" in capsys.readouterr().err
