"""Hard cases need scipy; the slow ones run when asked for, and a run of them all makes docs/hard_cases.md.

python -m pytest tests/hard_cases --slow-cases     minutes; needs the extras [fem] and [render]
"""

import csv
import io

import pytest
from conftest import ROOT

pytest.importorskip("scipy", reason="extra [fem] is not installed")

from hard_cases.case import COLLECTED, HARD, ROWS
from tactile_core.accuracy import Row
from tactile_core.files import atomic

HEAD = """# Hard cases

Made by `python -m pytest tests/hard_cases --slow-cases`. A case is *ok* where it converges within its target and breaks
no law of its stage (no node over 1 um in the indenter, no tension, forces balanced, Coulomb's cone, no cell inside out,
finite numbers), or where it says in words that it cannot: an error that names field and remedy, a flag, a stated error
that is as large.
*Of stated*: the error found over the error that the result states of itself. Truth: the full tier for the fast one, the
reference tier for the full one, finer meshes, double precision, formulas; the shipped recording's own meshes; the gel's
nodes for heights; Mitsuba's standard preset for the fast picture. Every case, what was expected and what was found:
[hard_cases.csv](hard_cases.csv).
"""


def pytest_configure(config: pytest.Config) -> None:
    """Declare the mark of the slow cases."""
    config.addinivalue_line("markers", "slow_case: takes long; left out unless --slow-cases is given")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that runs the slow cases."""
    parser.addoption("--slow-cases", action="store_true", help="hard cases that take long too; writes their page")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the slow cases, unless they are asked for."""
    if not config.getoption("--slow-cases", default=False):
        items[:] = [item for item in items if not item.get_closest_marker("slow_case")]


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the page, once every case of every difficulty has found something."""
    whole = {*COLLECTED} == ROWS.keys() and {row["case"] for row in ROWS.values()} == {*HARD}
    if whole and session.config.getoption("--slow-cases", default=False):
        rows = [ROWS[name] for name in COLLECTED]
        atomic.write_bytes(ROOT / "docs" / "hard_cases.md", page(rows).encode())
        atomic.write_bytes(ROOT / "docs" / "hard_cases.csv", table(rows).encode())


def page(rows: list[Row]) -> str:
    """Lay out how many cases of each difficulty are ok as Markdown."""
    lines = [HEAD, f"{sum(bool(row['ok']) for row in rows)} of {len(rows)} cases are ok.\n"]
    lines += ["| difficulty | cases | ok |", "|---|---|---|"]
    for hard in HARD:
        ok = [bool(row["ok"]) for row in rows if row["case"] == hard]
        lines.append(f"| {hard} | {len(ok)} | {sum(ok)} |")
    return "\n".join([*lines, ""])


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
