"""Where the time goes: seconds a named stage."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Adds up wall time by stage; a stage may be entered many times."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def per_frame(self, count: int) -> dict[str, float]:
        """ms a frame of each stage, in the order they were first entered, and in all."""
        stages = {name: round(1e3 * seconds / count, 4) for name, seconds in self.seconds.items()}
        return stages | {"all": round(1e3 * sum(self.seconds.values()) / count, 4)}
