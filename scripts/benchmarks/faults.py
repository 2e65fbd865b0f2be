"""Break `tactile batch` in every way we know, and see that nothing is lost: bytes as those of an undisturbed run.

    python scripts/fault_test.py --quick --json FILE     about a minute on one core
    python scripts/fault_test.py                         more recordings, more blows, an hour

Prints a row for each fault: shards that differ from the undisturbed run, are missing or half-written (target 0;
baseline: shards of the job). Exits 1 when a row misses its target. The Dask row needs the extra [batch], that of the
small disk the right to mount one (root), and says so without it. Linux alone.
"""

from __future__ import annotations

import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.fault_bench import Bench, Lost, end_all
from benchmarks.fault_kinds import ABSENT, FAULTS
from benchmarks.measured_rows import finished, parser_of, printed
from tactile_core.accuracy import Row, row

QUICK_LIMIT, LIMIT = 300, 3600  # s for one fault; a quick one takes 10 s, and 50 s where ten programs share two cores


def main(arguments: list[str] | None = None) -> int:
    """Try all faults; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="two short recordings and few blows")
    parser.add_argument("--seed", type=int, default=0, help="of the recordings and of the moments (default: 0)")
    parser.add_argument("--only", choices=FAULTS, help="this fault alone")
    options = parser.parse_args(arguments)
    signal.signal(signal.SIGALRM, late)
    limit = QUICK_LIMIT if options.quick else LIMIT
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), options.quick, options.seed)
        count = len(bench.known)
        chosen = {name: fault for name, fault in FAULTS.items() if options.only in (None, name)}
        rows = (tried(name, fault, bench, count, limit) for name, fault in chosen.items())
        return finished(printed(rows), options.json)


def tried(name: str, fault: Callable[[Bench], Lost | None], bench: Bench, count: int, limit: int) -> Row:
    """The row of a fault; one that did not strike, failed, or took over `limit` s counts as all lost."""
    began, trouble = time.monotonic(), ""
    signal.alarm(limit)
    try:
        found = fault(bench)
    except (Exception, TimeoutError) as error:
        found, trouble = (count, 0), f"; {type(error).__name__}: {error!s:.300}".replace("\n", " ")
    finally:
        signal.alarm(0)
        end_all()
    lost, blows = (None, 0) if found is None else found
    if found is not None and not blows:
        lost = count
    of = f"not tried: {ABSENT[name]}" if lost is None else f"{blows} blows, {time.monotonic() - began:.0f} s{trouble}"
    return row(f"fault_{name}_files_lost", lost, "files", None if lost is None else 0, baseline=count, of=of)


def late(*words: object) -> None:
    """The alarm's handler."""
    raise TimeoutError("took too long")
