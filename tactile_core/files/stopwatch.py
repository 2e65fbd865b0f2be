"""Measure wall time by named stage, in seconds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Sum of wall time by stage; a stage may be entered many times."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time of the block to the stage ``name``."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def per_frame(self, count: int) -> dict[str, float]:
        """Return ms per frame of each stage, in the order they were first entered, and of all together."""
        stages = {name: round(1e3 * seconds / count, 4) for name, seconds in self.seconds.items()}
        return stages | {"all": round(1e3 * sum(self.seconds.values()) / count, 4)}
