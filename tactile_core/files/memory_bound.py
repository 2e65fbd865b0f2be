"""Bound of the memory that the process may take while it reads what a stranger wrote."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

LOCK = threading.Lock()  # one bound at a time: each restores what it found


@contextmanager
def bounded_memory(more: int) -> Iterator[None]:
    """Let the process take at most ``more`` bytes beyond its present data; allocations beyond fail.

    On Linux alone: macOS and Windows have no such bound within a process.
    """
    if not sys.platform.startswith("linux"):
        yield
        return
    import resource

    with LOCK:
        before = resource.getrlimit(resource.RLIMIT_DATA)
        with open("/proc/self/statm") as file:
            present = int(file.read().split()[5]) * resource.getpagesize()
        limits = [present + more, *(limit for limit in before if limit != resource.RLIM_INFINITY)]
        resource.setrlimit(resource.RLIMIT_DATA, (min(limits), before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_DATA, before)
