"""Limit linear algebra to one thread: several threads' sums differ by rounding, and small matrices gain nothing."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import os
import sys
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import threadpoolctl

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
ONE = dict.fromkeys(VARIABLES, "1")


def one_thread() -> threadpoolctl.threadpool_limits:
    """Keep linear algebra in one thread: that of libraries loaded already, and by the environment those loaded later.

    It stays so for good, or for a block with the returned context manager (the environment stays). The same input then
    gives the same bytes in every process of a machine. A frame or contact gains nothing by several threads: on a busy
    machine a live picture took four times the processor time, pairs of contacts five times, a conversion 2.6 times."""
    import threadpoolctl

    os.environ.update(ONE)
    return threadpoolctl.threadpool_limits(1, user_api="blas")  # torch's own threads, of training, stay


class _OneThread(contextlib.ContextDecorator):
    """Keep linear algebra in one thread while a block, or a function decorated with it, runs in any thread."""

    def __init__(self) -> None:
        self._lock, self._running = threading.Lock(), 0
        self._before: list[tuple[threadpoolctl.LibController, int]] = []  # libraries, and their numbers of threads

    def __enter__(self) -> None:
        with self._lock:
            if not self._running:
                libraries = _libraries("scipy.linalg" in sys.modules)
                self._before = [(each, each.num_threads) for each in libraries if each.num_threads != 1]
                for library, _ in self._before:
                    _set_threads(library, 1)
            self._running += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._running -= 1
            for library, count in () if self._running else self._before:
                _set_threads(library, count)


in_one_thread = _OneThread()
if hasattr(os, "register_at_fork"):  # a child has none of the threads that are inside
    os.register_at_fork(after_in_child=in_one_thread.__init__)  # type: ignore[misc]


@functools.cache
def _libraries(scipy_is_loaded: bool) -> list[threadpoolctl.LibController]:
    """Return the loaded libraries of linear algebra, of which scipy brings its own; [] without threadpoolctl, as in a
    Blender without the extension's wheels."""
    if importlib.util.find_spec("threadpoolctl") is None:
        return []
    import threadpoolctl

    return threadpoolctl.ThreadpoolController().select(user_api="blas").lib_controllers


def _set_threads(library: threadpoolctl.LibController, count: int) -> None:
    """Set a library's number of threads, from any thread: since version 3.7 threadpoolctl lets only the first thread
    that set it do so, until told otherwise."""
    free = getattr(library, "clear_controlling_thread", None)
    if free is not None:
        free(force=True)
    library.set_num_threads(count)
    if free is not None:
        free(force=True)
