"""Measure wall and CPU time by named stage, in seconds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Sums, by the stage's name, of wall time (`seconds`) and of this process's CPU time (`cpu_seconds`)."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.cpu_seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time that the block takes to the stage ``name``."""
        start, cpu_start = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
            self.cpu_seconds[name] = self.cpu_seconds.get(name, 0.0) + time.process_time() - cpu_start

    def per_frame(self, count: int) -> dict[str, dict[str, float]]:
        """Return ms per frame, of `count`: ms_a_frame by the wall clock, cpu_ms_a_frame; by stage, and in all."""
        return {"ms_a_frame": _per_frame(self.seconds, count), "cpu_ms_a_frame": _per_frame(self.cpu_seconds, count)}


def _per_frame(seconds: dict[str, float], count: int) -> dict[str, float]:
    stages = {name: round(1e3 * each / count, 4) for name, each in seconds.items()}
    return stages | {"all": round(1e3 * sum(seconds.values()) / count, 4)}
