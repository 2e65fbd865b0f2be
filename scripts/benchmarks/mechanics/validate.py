"""Hold contact mechanics against known answers, and its fast tier against its reference tier.

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

from benchmarks.measured_rows import finished, parser_of
from benchmarks.mechanics import fluid, golden, hertz, manufactured, oracle, tiers
from benchmarks.mechanics.mechanics_page import write
from tactile_core.accuracy import HEADER, Row, line
from tactile_core.accuracy import row as make_row

ROOT = Path(__file__).resolve().parents[3]
REPORT = ROOT / "docs" / "mechanics.md"

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
    """Rows of a check; one that breaks off ends with a row that says so, and the others go on."""
    try:
        yield from CHECKS[name][0](quick)
    except Exception:  # whatever it was, the other checks are still worth their rows
        traceback.print_exc()
        yield make_row(f"{name}_completed", 0, "1", 1, of="broke off, see the error", at_least=True)
