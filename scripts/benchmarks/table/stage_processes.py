"""Run each method in its own process, so that its memory and its first call are its own."""

from __future__ import annotations

import concurrent.futures
import importlib
import multiprocessing
import sys
import time
from collections.abc import Iterator, Sequence

from .method import Method

STAGES = ("mechanics", "translation", "pictures", "chain", "photographs")
WITH_FILE = ("pictures", "chain", "photographs")  # which take a file or a folder
LEAVE_TRUTH = ("pictures", "chain")  # whose first method leaves the truth that the others are measured against


def measured(stage: str, quick: bool, file: str, missing: dict[str, str], only: Sequence[str] = ()) -> Iterator[Method]:
    """Measure every method of a stage; those that cannot run here are noted in ``missing``.

    file : where the first method of pictures and chain leaves the others' truth; the photographs
    only : words that name a stage, or a stage and a method; none for all
    """
    names = importlib.import_module(f"benchmarks.table.{stage}_methods").NAMES
    wanted = [name for name in names if not only or stage in only or f"{stage} {name}" in only]
    if wanted and stage in LEAVE_TRUTH:
        wanted = list(dict.fromkeys([names[0], *wanted]))
    for name in wanted:
        began = time.perf_counter()
        with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            try:
                found = pool.submit(one, stage, name, quick, file).result()
            except ModuleNotFoundError as error:
                missing[f"{stage} {name}"] = f"no {error.name}"
                continue
        print(f"{stage} {name}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
        if found is not None:
            yield found


def one(stage: str, name: str, quick: bool, file: str) -> Method | None:
    """Measure one method; it is run in a process of its own."""
    measure = importlib.import_module(f"benchmarks.table.{stage}_methods").measure
    return measure(name, quick, file) if stage in WITH_FILE else measure(name, quick)
