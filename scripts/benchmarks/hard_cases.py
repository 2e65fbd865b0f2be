"""Run every hard case of every stage it concerns, and print the table of what was expected and what was found.

    python scripts/benchmarks/hard_cases.py                       all of them (minutes); writes docs/hard_cases.md
    python scripts/benchmarks/hard_cases.py --quick --json FILE   the quick ones, those of the tests; writes FILE alone

A case is within its target and breaks no law of its stage, or says in words that it cannot; exits 1 when one is not.
Needs the extras [fem] and [render]. The cases are in tests/hard_cases.
"""

from __future__ import annotations

import sys
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / each) for each in (".", "scripts", "tests", "tests/helpers")]

from hard_cases import CASES, HARD  # noqa: E402
from hard_cases.case import Case  # noqa: E402

from benchmarks.measured_rows import finished, parser_of, printed  # noqa: E402
from tactile_core.accuracy import Row  # noqa: E402
from tactile_core.accuracy import row as make_row  # noqa: E402
from tactile_core.files import atomic  # noqa: E402

REPORT = ROOT / "docs" / "hard_cases.md"
HEAD = """# Hard cases

Made by `python scripts/benchmarks/hard_cases.py`. A case is *ok* where it converges within its target and breaks no law
of its stage (no node over 1 um in the indenter, no tension, forces balanced, Coulomb's cone, no cell inside out, finite
numbers), or where it says in words that it cannot: an error that names field and remedy, a flag, a stated error that is
as large.
*Of stated*: the error found over the error that the result states of itself. Truth: the full tier for the fast one, the
reference tier for the full one, finer meshes, double precision, formulas; the shipped recording's own meshes; the gel's
nodes for heights; Mitsuba's standard preset for the fast picture.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the cases, print and write their rows; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="without the slow cases")
    options = parser.parse_args(arguments)
    rows = printed(_row(case) for case in CASES if not (options.quick and case.slow))
    if not options.quick:
        atomic.write_bytes(REPORT, markdown(rows).encode())
    return finished(rows, options.json)


def _row(case: Case) -> Row:
    """Make the row of a case; one that breaks off misses."""
    try:
        return case.row()
    except Exception as error:  # whatever it was, the other cases are still worth their rows
        traceback.print_exc()
        made = make_row(case.name, 0, "answers", 1, of=case.stage, at_least=True)
        return made | {"case": case.hard, "expected": case.expected, "words": f"broke off: {error}"}


def markdown(rows: list[Row]) -> str:
    """The table, a hard case a section."""
    parts = [HEAD]
    met = sum(bool(row["ok"]) for row in rows)
    parts.append(f"{met} of {len(rows)} cases are ok.\n")
    for hard in HARD:
        parts.append(f"## {hard[0].upper()}{hard[1:]}\n\n| stage | case | expected | found | |\n|---|---|---|---|---|")
        parts += [_line(row) for row in rows if row["case"] == hard]
        parts.append("")
    return "\n".join(parts)


def _line(row: Row) -> str:
    number = f"{row['value']:.3g} {row['unit']}"
    found = row["words"] if row["unit"] == "said" else number + (f": {row['words']}" if row["words"] else "")
    cells = [row["set"], row["name"], row["expected"], found, "ok" if row["ok"] else "**MISSED**"]
    return "| " + " | ".join(cell.replace("|", "/").replace("\n", " ") for cell in cells) + " |"


if __name__ == "__main__":
    sys.exit(main())
