"""The table of speed against error in a simulator's loop."""

import importlib
import json

import pytest

pytest.importorskip("numba", reason="numba is not installed")


def test_the_table_has_every_kind_of_step_and_its_error(tmp_path, monkeypatch, capsys):
    measure_loop = importlib.import_module("benchmarks.measure_loop")
    monkeypatch.setattr(measure_loop, "WARM", 0)
    written = tmp_path / "rows.json"
    assert measure_loop.main(["--count", "2", "--json", str(written)]) == 0
    rows, table = json.loads(written.read_text()), capsys.readouterr().out
    assert {row["unit"] for row in rows} == {"ms"} and all(row["value"] > 0 for row in rows)
    assert len(rows) == 6 * 10 and "loop_digit_alone_cpu" in {row["name"] for row in rows}
    lines = table.splitlines()[-2 - 10 :]
    assert lines[0].startswith("| | CPU ms: median |") and "from the full tier" in table
    assert all(line.count("|") == 9 for line in lines)
