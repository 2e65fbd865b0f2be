"""The benchmark runs, says what it measured, and writes what can be read; never how fast."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPTS = Path(__file__).parents[2] / "scripts"


@pytest.fixture(scope="module")
def script():
    path = list(sys.path)
    import benchmark

    yield benchmark
    sys.path[:] = path


def test_a_stage_runs_and_its_rows_can_be_read(script, tmp_path):
    file = tmp_path / "rows.json"
    methods = ["translation numpy_1", "mechanics digit_fast", "conditions two_balls"]
    assert script.main(["--quick", "--only", *methods, "--json", str(file)]) == 0
    rows = {row["name"]: row for row in json.loads(file.read_text())}
    left, force = (rows[f"conditions_two_balls_{name}"]["value"] for name in ("error", "force_error"))
    assert 0 < left < 1 and 0 < force < 20
    for method in ("translation_numpy_1", "mechanics_digit_fast"):
        error = rows[f"{method}_error"]
        assert rows[f"{method}_ms"]["value"] > 0 and rows[f"{method}_MB"]["value"] > 20
        assert 0 < error["value"] < error["baseline"] and error["unit"] == "um" and error["set"]


def test_the_front_holds_what_nothing_beats_in_both(script):
    from benchmarks.table.benchmark_page import pareto

    front = pareto([(3, 1.0), (1, 4.0), (2, 5.0), (2.5, 2.0), (9, 1.0)])
    assert front == [(1, 4.0), (2.5, 2.0), (3, 1.0)]


def test_a_promise_counts_what_stayed_below(script):
    from benchmarks.table.promised import Promise

    promise = Promise("x", "um", np.array([2.0, 2, 2, 2]), np.array([1.0, 1, 1, 3]), list("aabb"), "four")
    assert promise.covered() == 0.75 and promise.row()["ok"] is None
    many = Promise("x", "um", np.full(400, 2.0), np.tile([1.0, 1, 1, 3], 100), ["a"] * 400, "four hundred")
    assert many.row()["ok"] is False and many.row()["value"] == 0.75
    assert [line.split(" | ")[-1] for line in promise.lines()] == ["75.0% |", "100.0% |", "50.0% |"]


def test_the_page_that_ships_says_what_its_rows_say(script):
    from benchmarks.table.benchmark_page import TITLES, as_line
    from benchmarks.table.method import Method

    docs = SCRIPTS.parent / "docs"
    rows = {row["name"]: row for row in json.loads((docs / "benchmark.json").read_text())["rows"]}
    parts = (docs / "benchmark.md").read_text().split("\n## ")
    for stage, title in TITLES.items():
        lines = [line for part in parts if part.startswith(title) for line in part.splitlines() if line[:3] == "| `"]
        names = {line.split("`")[1] for line in lines}
        assert names == {
            name.removeprefix(f"{stage}_").removesuffix("_ms")
            for name in rows
            if name.startswith(f"{stage}_") and name.endswith("_ms")
        }
        for line in lines:
            name = line.split("`")[1]
            ms, mb, error = (rows[f"{stage}_{name}_{what}"] for what in ("ms", "MB", "error"))
            numbers = ms["value"], mb["value"], error["value"], error["unit"], error["baseline"], error["set"]
            assert line == as_line(Method(stage, name, *numbers))


def test_the_report_that_ships_can_be_read_and_draws(script):
    from benchmarks.table.benchmark_page import plot
    from benchmarks.table.method import Method

    said = json.loads((SCRIPTS.parent / "docs" / "benchmark.json").read_text())
    names = [row["name"] for row in said["rows"]]
    assert {f"{name}_ms" for name in ("mechanics_digit_fast", "translation_numpy_1", "pictures_fast", "chain_fast")} < {
        *names
    }
    assert len(names) == len(set(names))
    methods = [Method("chain", name, ms, 1.0, 5 / ms, "levels", 9.0, "set") for name, ms in (("a", 1.0), ("b", 3.0))]
    assert plot(methods).startswith(b"\x89PNG")


def test_a_stage_that_does_not_exist_is_refused(script, capsys):
    with pytest.raises(SystemExit):
        script.main(["--only", "mechanic"])
    assert "no stage mechanic; there are mechanics, translation" in capsys.readouterr().err
