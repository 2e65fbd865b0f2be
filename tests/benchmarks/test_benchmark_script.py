"""The benchmark runs, says what it measured, and writes what can be read; never how fast."""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPTS = Path(__file__).parents[2] / "scripts"


@pytest.fixture(scope="module")
def script():
    path = list(sys.path)
    spec = importlib.util.spec_from_file_location("benchmark_script", SCRIPTS / "benchmark.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    sys.path[:] = path


def test_a_stage_runs_and_its_rows_can_be_read(script, tmp_path, capsys):
    file = tmp_path / "rows.json"
    arguments = ["--quick", "--only", "translation numpy_1", "mechanics digit_fast", "--json", str(file)]
    assert script.main(arguments) == 0
    rows = {row["name"]: row for row in json.loads(file.read_text())}
    for method in ("translation_numpy_1", "mechanics_digit_fast"):
        error = rows[f"{method}_error"]
        assert rows[f"{method}_ms"]["value"] > 0 and rows[f"{method}_MB"]["value"] > 20
        assert 0 < error["value"] < error["null"] and error["unit"] == "um" and error["set"]
    assert "photographs, no PRESSES given" in capsys.readouterr().err


def test_the_front_holds_what_nothing_beats_in_both(script):
    from benchmarks.report import pareto, steps

    front = pareto([(3, 1.0), (1, 4.0), (2, 5.0), (2.5, 2.0), (9, 1.0)])
    assert front == [(1, 4.0), (2.5, 2.0), (3, 1.0)]
    assert steps(front) == [(1, 4.0), (2.5, 4.0), (2.5, 2.0), (3, 2.0), (3, 1.0)]


def test_a_promise_counts_what_stayed_below(script):
    from benchmarks.promise import Promise

    promise = Promise("x", "um", np.array([2.0, 2, 2, 2]), np.array([1.0, 1, 1, 3]), list("aabb"), "four")
    assert promise.covered() == 0.75 and promise.row()["ok"] is False
    assert [line.split(" | ")[-1] for line in promise.lines()] == ["75.0% |", "100.0% |", "50.0% |"]


def test_the_report_that_ships_can_be_read_and_draws(script):
    from benchmarks.method import Method
    from benchmarks.report import plot

    told = json.loads((SCRIPTS.parent / "docs" / "benchmark.json").read_text())
    names = [row["name"] for row in told["rows"]]
    assert {f"{name}_ms" for name in ("mechanics_digit_fast", "translation_numpy_1", "pictures_fast", "chain_fast")} < {
        *names
    }
    assert len(names) == len(set(names))
    methods = [Method("chain", name, ms, 1.0, 5 / ms, "levels", 9.0, "set") for name, ms in (("a", 1.0), ("b", 3.0))]
    assert plot(methods).startswith(b"\x89PNG")
