"""Hard cases need scipy; a run of them all, slow ones too, renews the table of docs/hard_cases.md and its CSV.

python -m pytest tests/hard_cases -m ""     minutes; needs the extras [fem] and [render]
"""

import csv
import io

import pytest
from benchmarks.measured_rows import renew_tables
from conftest import ROOT

pytest.importorskip("scipy", reason="extra [fem] is not installed")

from hard_cases.case import COLLECTED, HARD, ROWS
from tactile_core.accuracy import Row
from tactile_core.files import atomic


def pytest_sessionfinish() -> None:
    """Write the page's tables, once every case of every difficulty has found something."""
    if {*COLLECTED} == ROWS.keys() and {row["case"] for row in ROWS.values()} == {*HARD}:
        rows = [ROWS[name] for name in COLLECTED]
        head = "| difficulty | cases | ok |"
        renew_tables(ROOT / "docs" / "hard_cases.md", {head: [head, "|---|---|---|", *counts(rows)]})
        atomic.write_bytes(ROOT / "docs" / "hard_cases.csv", table(rows).encode())


def counts(rows: list[Row]) -> list[str]:
    """Lay out how many cases there are and how many are ok, of each difficulty and of all."""
    by_hard = {hard: [bool(row["ok"]) for row in rows if row["case"] == hard] for hard in HARD}
    by_hard["all"] = [bool(row["ok"]) for row in rows]
    return [f"| {hard} | {len(ok)} | {sum(ok)} |" for hard, ok in by_hard.items()]


def table(rows: list[Row]) -> str:
    """Lay out the cases as CSV, a difficulty after the other."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(["difficulty", "stage", "case", "expected", "found", "ok"])
    for row in sorted(rows, key=lambda row: HARD.index(row["case"])):
        number = f"{row['value']:.3g} {row['unit']}"
        found = row["words"] if row["unit"] == "said" else number + (f": {row['words']}" if row["words"] else "")
        lines.writerow([row["case"], row["set"], row["name"], row["expected"], found.replace("\n", " "), row["ok"]])
    return text.getvalue()
