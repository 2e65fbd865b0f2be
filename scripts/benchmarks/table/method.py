"""Define the results of a benchmarked method: CPU time, peak memory, error beside that of doing nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.simulation.pairs_file import Pairs, read_pairs

ROOT = Path(__file__).resolve().parents[3]
TRAINING = ROOT / "scenes" / "training"
EVERY = 7  # one test press in so many, in a quick run; prime to how box, ring and others take turns


def test_contacts(quick: bool) -> Pairs:
    """Read the test contacts that ship; quick : those of one press in ``EVERY`` alone"""
    pairs = read_pairs(TRAINING / "test_contacts.h5")
    return pairs.select_rows(np.flatnonzero(pairs.press % EVERY == 0)) if quick else pairs


@dataclass(frozen=True)
class Method:
    """Results of the method ``name`` of a stage.

    ms : CPU ms per frame on one core; mb : MB, peak memory of a process that does this alone
    error, baseline : errors of this method and of doing nothing, in ``unit``; of : on what they were measured, a text
    more : further rows"""

    stage: str
    name: str
    ms: float | None
    mb: float | None
    error: float | None
    unit: str
    baseline: float | None
    of: str
    more: tuple[Row, ...] = ()

    def rows(self) -> list[Row]:
        """Return time, memory and error as rows, then ``more``."""
        name = f"{self.stage}_{self.name}"
        found = [row(f"{name}_ms", self.ms, "ms", of="one core, CPU"), row(f"{name}_MB", self.mb, "MB", of="peak")]
        return [*found, row(f"{name}_error", self.error, self.unit, baseline=self.baseline, of=self.of), *self.more]


def best_ms(work: Callable[[], object], frames: int = 1, most: int = 50) -> float:
    """Return the least CPU ms per frame over repeated calls of ``work``, after a first that may compile. frames :
    number in a call. Calls are repeated for 0.5 s of CPU, at least 3 and at most ``most`` times."""
    work()
    took, began = [], time.process_time()
    while len(took) < 3 or (time.process_time() - began < 0.5 and len(took) < most):
        start = time.process_time()
        work()
        took.append(time.process_time() - start)
    return 1e3 * min(took) / frames


def peak_mb() -> float:
    """Return this process's peak memory, MB; on Linux by its own high-water mark: getrusage counts the parent's too."""
    if sys.platform == "linux":
        for text in Path("/proc/self/status").read_text().splitlines():
            if text.startswith("VmHWM:"):
                return int(text.split()[1]) / 1024
    import resource

    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / (1024 * 1024 if sys.platform == "darwin" else 1024)
