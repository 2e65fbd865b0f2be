"""Limit numpy to one thread a process: for parallel workers, and where a user waits for each frame."""

from __future__ import annotations

import os

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
ONE = dict.fromkeys(VARIABLES, "1")


def one_thread() -> None:
    """Keep numpy, if it is not imported yet, from computing in several threads, unless the user said how many.

    A single frame or contact is too small to gain by several, and on a busy machine they wait for each other while
    using the processor: a live picture took four times the processor time, pairs of contacts five times, a conversion
    2.6 times.
    """
    for name, count in ONE.items():
        os.environ.setdefault(name, count)
