"""The table of speed against error in a simulator's loop: both ways side by side."""

import importlib
import json

import pytest

pytest.importorskip("numba", reason="the extra [fast] is not installed")


def test_the_table_has_both_ways_and_their_errors(tmp_path, monkeypatch, compiled_loops):
    compiled_loops(True)
    measure_loop = importlib.import_module("benchmarks.measure_loop")
    monkeypatch.setattr(measure_loop, "WARM", 0)
    written = [tmp_path / "rows.json", tmp_path / "table.md"]
    assert measure_loop.main(["--count", "2", "--json", str(written[0]), "--markdown", str(written[1])]) == 0
    rows, table = json.loads(written[0].read_text()), written[1].read_text()
    assert {row["unit"] for row in rows} == {"ms"} and all(row["value"] > 0 for row in rows)
    assert table.count("| numpy |") == table.count("| compiled |") == 7
    assert "um from numpy" in table and "from the full tier" in table
