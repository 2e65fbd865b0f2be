"""Break `tactile batch` in every way we know, and see that nothing is lost: bytes as those of an undisturbed run.

    python scripts/fault_test.py --quick --json FILE     about two minutes on one core
    python scripts/fault_test.py                         more recordings, more blows

Prints a row for each fault: shards that differ from the undisturbed run, are missing or half-written (target 0; null:
shards of the job). Exits 1 when a row misses its target. The Dask row needs the extra [batch], and says so without it.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from fault_bench import Bench, Lost
from fault_kinds import FAULTS

from tactile_core import atomic
from tactile_core.rows import HEADER, Row, failed, line, row


def main(arguments: list[str] | None = None) -> int:
    """Try all faults; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="two short recordings and few blows")
    parser.add_argument("--json", metavar="FILE", help="write the rows here")
    parser.add_argument("--seed", type=int, default=0, help="of the recordings and of the moments (default: 0)")
    parser.add_argument("--only", choices=FAULTS, help="this fault alone")
    options = parser.parse_args(arguments)
    print(HEADER)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), options.quick, options.seed)
        count = len(bench.known)
        for name, fault in FAULTS.items():
            if options.only in (None, name):
                found.append(tried(name, fault, bench, count))
                print(line(found[-1]), flush=True)
    if options.json:
        atomic.write_json(Path(options.json), found)
    return int(bool(failed(found)))


def tried(name: str, fault: Callable[[Bench], Lost | None], bench: Bench, count: int) -> Row:
    """The row of a fault; a fault that did not strike counts as lost."""
    began = time.monotonic()
    found = fault(bench)
    lost, blows = (None, 0) if found is None else found
    if found is not None and not blows:
        lost = count
    of = "not tried: distributed is absent" if lost is None else f"{blows} blows, {time.monotonic() - began:.0f} s"
    return row(f"fault_{name}_files_lost", lost, "files", None if lost is None else 0, null=count, of=of)


if __name__ == "__main__":
    sys.exit(main())
