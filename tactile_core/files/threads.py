"""Limit linear algebra to one thread: several threads' sums differ by rounding, and small matrices gain nothing."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import threadpoolctl

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
ONE = dict.fromkeys(VARIABLES, "1")


def one_thread() -> threadpoolctl.threadpool_limits:
    """Keep linear algebra in one thread: libraries loaded already, and by the environment those loaded later.

    It stays so for good, or for a block with the returned context manager (the environment stays). The same input then
    gives the same bytes in every process of a machine. A single frame or contact gains nothing by several threads: on a
    busy machine a live picture took four times the processor time, pairs of contacts five times, a conversion 2.6
    times."""
    import threadpoolctl

    os.environ.update(ONE)
    return threadpoolctl.threadpool_limits(1, user_api="blas")  # torch's own threads, of training, stay
