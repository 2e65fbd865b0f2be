"""Run every hard case of every stage it concerns, and print the table of what was expected and what was found.

    python scripts/benchmarks/hard_cases.py                       all of them (minutes); writes docs/hard_cases.md
    python scripts/benchmarks/hard_cases.py --quick --json FILE   the quick ones, those of the tests; writes FILE alone
    python scripts/benchmarks/hard_cases.py --markdown FILE       the table goes there

A case is within its target and breaks no law of its stage, or says in words that it cannot; exits 1 when one is not,
but for those whose limit is known and stands beside them (they are MISSED in the table, too).
Needs the extras [fem] and [render]. The cases are in tests/hard_cases.
"""

from __future__ import annotations

import argparse
import sys
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / each) for each in (".", "scripts", "tests", "tests/helpers")]

from hard_cases.case import Case  # noqa: E402
from hard_cases.table import CASES, HARD  # noqa: E402

from tactile_core.accuracy import HEADER, Row, failed, line  # noqa: E402
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
    """Run the checks, print and write their rows; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="without the slow cases")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows here")
    parser.add_argument(
        "--markdown", metavar="FILE", type=Path, help=f"write the table here (all cases: {REPORT.name})"
    )
    options = parser.parse_args(arguments)
    rows = []
    print(HEADER)
    for case in CASES:
        if not (options.quick and case.slow):
            rows.append(_row(case))
            print(line(rows[-1]), flush=True)
    report = options.markdown or (None if options.quick else REPORT)
    if options.json:
        atomic.write_json(options.json, rows)
    if report:
        atomic.write_bytes(report, markdown(rows).encode())
    for row in failed(rows):
        print(f"MISSED: {row['name']} = {row['value']} {row['unit']}: {row['words']} {row['limit']}", file=sys.stderr)
    return int(any(not row["limit"] for row in failed(rows)))


def _row(case: Case) -> Row:
    """Make the row of a case; one that breaks off misses."""
    try:
        return case.row()
    except Exception as error:  # whatever it was, the other cases are still worth their rows
        traceback.print_exc()
        made = make_row(case.name, 0, "answers", 1, of=case.stage, at_least=True)
        return made | {"case": case.hard, "expected": case.expected, "words": f"broke off: {error}", "limit": ""}


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
    found += f". Limit: {row['limit']}" if row["limit"] else ""
    cells = [row["set"], row["name"], row["expected"], found, "ok" if row["ok"] else "**MISSED**"]
    return "| " + " | ".join(cell.replace("|", "/").replace("\n", " ") for cell in cells) + " |"


if __name__ == "__main__":
    sys.exit(main())
