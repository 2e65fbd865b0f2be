"""Compare contact mechanics with known answers, and its fast tier with its reference tier.

    python scripts/validate_mechanics.py                       every row; tables of docs/mechanics.md
    python scripts/validate_mechanics.py --quick --json FILE   under five minutes; writes FILE alone
    python scripts/validate_mechanics.py --only hertz golden   some checks; writes no report

Prints a table as it goes; exits 1 when an error row misses its target. Needs the extra [fem]; scikit-fem for `oracle`.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.measured_rows import finished, parser_of, renew_tables, short, write_table
from benchmarks.mechanics import fluid, golden, hertz, manufactured, oracle, tiers

from tactile_core.accuracy import HEADER, Row, failed, line
from tactile_core.accuracy import row as make_row

ROOT = Path(__file__).resolve().parents[1]
REPORT = ROOT / "docs" / "mechanics.md"
_TIERS = "| tier | DIGIT: time | shape | force | BioTac: time | shape | force |", "|---|---|---|---|---|---|---|"
_CHECKS = "| check | rows | with a target | errors that miss it |", "|---|---|---|---|"


# name -> function(quick) that yields rows, and what it shows, for the report
CHECKS: dict[str, tuple[Callable[[bool], Iterator[Row]], str]] = {
    "order": (manufactured.rows, "Order of accuracy on a manufactured finite deformation (theory: 3 and 2)"),
    "oracle": (oracle.rows, "scikit-fem as oracle: the same equations assembled by another library"),
    "golden": (golden.rows, "Golden forces: a ball of 3.5 mm on a bonded layer of 3 mm, to 60 % of its thickness"),
    "hertz": (hertz.rows, "Hertz: a small contact on a deep block"),
    "fluid": (fluid.rows, "The fluid keeps its volume"),
    "tiers": (tiers.rows, "The fast and the full tier against the reference tier: error beside time"),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the checks, print and write their rows; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer depths and meshes")
    parser.add_argument("--only", nargs="+", choices=CHECKS, metavar="CHECK", help=f"of {', '.join(CHECKS)}")
    options = parser.parse_args(arguments)
    found: dict[str, list[Row]] = {}
    print(HEADER)
    for name in options.only or CHECKS:
        started = time.perf_counter()
        print(f"{name} ...", file=sys.stderr, flush=True)
        found[name] = []
        for row in measured(name, options.quick):
            found[name].append(row)
            print(line(row), flush=True)
        print(f"{name}: {time.perf_counter() - started:.0f} s", file=sys.stderr, flush=True)
    rows = [row for part in found.values() for row in part]
    if not options.quick and not options.only:
        write(REPORT, {CHECKS[name][1]: part for name, part in found.items()})
    return finished(rows, options.json)


def measured(name: str, quick: bool) -> Iterator[Row]:
    """Yield the rows of the check ``name``; if it raises an error, a last row says so, and other checks can go on."""
    try:
        yield from CHECKS[name][0](quick)
    except Exception:  # whatever it was, the other checks are still worth their rows
        traceback.print_exc()
        yield make_row(f"{name}_completed", 0, "1", 1, of="broke off, see the error", at_least=True)


def write(report: Path, parts: dict[str, list[Row]]) -> None:
    """Renew the two tables of the page ``report``, and the CSV of all rows beside it; parts : heading -> its rows.
    Raises ValueError for a page without the tables."""
    rows = [row for part in parts.values() for row in part]
    checks = [*_CHECKS, *(_check(heading, part) for heading, part in parts.items())]
    renew_tables(report, {_TIERS[0]: _tier_table(rows), _CHECKS[0]: checks})
    write_table(report.with_suffix(".csv"), parts)


def _check(heading: str, rows: list[Row]) -> str:
    """Return a check's line of a Markdown table: how many rows it has, how many have a target, and which miss it."""
    missed = ", ".join(f"`{row['name']}` {short(row['value'])} {row['unit']}" for row in failed(rows))
    return f"| {heading} | {len(rows)} | {sum(row['ok'] is not None for row in rows)} | {missed} |"


def _tier_table(rows: list[Row]) -> list[str]:
    """Return the lines of a Markdown table of the tiers' times and errors at 0.6 mm; cells not measured are empty."""
    found = {row["name"]: row for row in rows}

    def number(name: str, unit: str, scale: float = 1.0, field: str = "value") -> str:
        value = found[name][field] if name in found else None
        return "" if value is None else f"{short(abs(scale * value))} {unit}"

    lines = [*_TIERS]
    for tier in ("fast", "full", "reference"):
        cells = [tier]
        for sensor in ("digit", "biotac"):
            name, quick = f"{sensor}_{tier}_0.6mm", tier == "fast"
            cells += [  # only the reference tier's time is recorded in s, not ms
                number(f"{name}_time", "ms" if quick else "s", 1e-3 if tier == "full" else 1.0),
                number(f"{name}_shape_rms", "um"),
                number(f"{name}_force_error", "%"),
            ]
        lines.append(f"| {' | '.join(cells)} |")
    cells = ["nothing computed"]
    for sensor in ("digit", "biotac"):
        base = f"{sensor}_fast_0.6mm"
        cells += ["", number(f"{base}_shape_rms", "um", field="baseline")]
        cells += [number(f"{base}_force_error", "%", field="baseline")]
    return [*lines, f"| {' | '.join(cells)} |"]


if __name__ == "__main__":
    sys.exit(main())
