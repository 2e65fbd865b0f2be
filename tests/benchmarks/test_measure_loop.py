"""The table of speed against error in a simulator's loop."""

import importlib
import json

import pytest

pytest.importorskip("numba", reason="numba is not installed")


def test_the_table_has_every_kind_of_step_and_its_error(tmp_path, monkeypatch):
    measure_loop = importlib.import_module("benchmarks.measure_loop")
    monkeypatch.setattr(measure_loop, "WARM", 0)
    written = [tmp_path / "rows.json", tmp_path / "table.md"]
    assert measure_loop.main(["--count", "2", "--json", str(written[0]), "--markdown", str(written[1])]) == 0
    rows, table = json.loads(written[0].read_text()), written[1].read_text()
    assert {row["unit"] for row in rows} == {"ms"} and all(row["value"] > 0 for row in rows)
    assert len(rows) == 6 * 7 and "loop_digit_alone_cpu" in {row["name"] for row in rows}
    assert len(table.splitlines()) == 2 + 7 and "from the full tier" in table
