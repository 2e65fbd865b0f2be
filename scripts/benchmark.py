"""Measure speed and error of every stage, in one run on one machine; write a table, a plot and rows.

    python scripts/benchmark.py                      everything; writes docs/benchmark.*
    python scripts/benchmark.py --quick --json FILE  under three minutes; writes FILE alone
    python scripts/benchmark.py --only chain --json FILE    some stages, or methods such as "translation numpy_1"

Stages: contact mechanics by tier and sensor; translation; conditions that are hard for it; pictures by preset; the
whole chain from signals to pictures; pictures by others' programs, where they are installed.
Each method is measured in a process of its own: CPU time on one core, peak memory, and the error on a held-out set
beside that of doing nothing. Then stated bounds on the error are compared with measured errors: exits with 1 if a
bound of 95 % holds for under 90 or over 98 %. Methods whose library is missing are left out and named. Needs the
extras [fem] and [render].
"""

from __future__ import annotations

import concurrent.futures
import importlib
import multiprocessing
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.measured_rows import finished, parser_of, printed
from benchmarks.table.method import ROOT, Method

from tactile_core.errors import TactileError
from tactile_core.files import compiled, threads

STAGES = ("mechanics", "translation", "conditions", "pictures", "chain", "peers")
# Whose first method leaves the truth that the others are measured against, in a file.
LEAVE_TRUTH = "pictures", "chain"


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer contacts, coarser reference pictures")
    parser.add_argument("--only", nargs="+", default=(), metavar="STAGE", help="measure these alone; writes no report")
    options = parser.parse_args(arguments)
    unknown = [each for each in options.only if each.split(" ")[0] not in STAGES]
    if unknown:
        parser.error(f"--only: no stage {', '.join(unknown)}; there are {', '.join(STAGES)}")
    threads.one_thread()  # here and in the processes that this starts: times are of one core
    os.environ.setdefault(compiled.SWITCH, "1")  # loops at their first call: what is timed is warm
    missing: dict[str, str] = {}
    try:
        methods = list(all_measured(options.only, options.quick, missing))
        rows = [each for method in methods for each in method.rows()]
        if not options.only:
            from benchmarks.table.promised import promised

            found, tables = promised(options.quick)
            rows += found
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    printed(rows)
    for name, why in missing.items():
        print(f"left out: {name}, {why}", file=sys.stderr)
    if not (options.quick or options.only):
        from benchmarks.table.benchmark_page import write_report

        write_report(ROOT / "docs", methods, rows, missing, tables)
    return finished(rows, options.json)


def all_measured(only: Sequence[str], quick: bool, missing: dict[str, str]) -> Iterator[Method]:
    """Measure the methods of all stages, each in a process of its own. quick : on less data

    only : texts that name a stage, or a stage and a method; none for all
    missing : gets method -> reason for each that cannot run"""
    with tempfile.TemporaryDirectory() as scratch:
        for stage in STAGES:
            names = importlib.import_module(f"benchmarks.table.{stage}_methods").NAMES
            wanted = [name for name in names if not only or stage in only or f"{stage} {name}" in only]
            file = (str(Path(scratch) / f"{stage}.npz"),) if stage in LEAVE_TRUTH else ()
            if wanted and file:
                wanted = list(dict.fromkeys([names[0], *wanted]))
            for name in wanted:
                began = time.perf_counter()
                with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
                    try:
                        found = pool.submit(one_measured, stage, name, quick, *file).result()
                    except ModuleNotFoundError as error:
                        missing[f"{stage} {name}"] = f"no {error.name}"
                        continue
                print(f"{stage} {name}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
                if found is not None:
                    yield found


def one_measured(stage: str, *options: Any) -> Method | None:
    """Measure one method of a stage in the present process; None for one that only writes the truth for the others.
    options : name of the method, whether on less data, and the file of the truth where the stage has one"""
    return importlib.import_module(f"benchmarks.table.{stage}_methods").measure(*options)


if __name__ == "__main__":
    sys.exit(main())
