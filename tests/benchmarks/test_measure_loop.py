"""The table of speed against error in a simulator's loop."""

import importlib

import pytest

pytest.importorskip("numba", reason="numba is not installed")


def test_the_table_has_every_kind_of_step_and_its_error(monkeypatch, capsys):
    measure_loop = importlib.import_module("benchmarks.measure_loop")
    monkeypatch.setattr(measure_loop, "WARM", 0)
    monkeypatch.setattr(measure_loop, "STEPS", 2)
    assert measure_loop.main(["--count", "2"]) == 0
    head, _, *lines = capsys.readouterr().out.splitlines()
    assert head.startswith("| | CPU ms: median |") and len(lines) == 10
    assert lines[0].startswith("| digit, alone |") and "from the full tier" in lines[0]
    assert all(line.count("|") == 9 for line in lines)
    assert all(float(cell) > 0 for line in lines for cell in line.split("|")[2:8])
