"""Compile loops by numba where the extra [fast] is installed; where it is not, numpy does the same work.

A loop is written once, as plain Python over arrays. numba is imported at its first call; what it compiles is kept on
disk, beside the source or in the user's cache, and read from there by the next process.
"""

from __future__ import annotations

import functools
import gc
import importlib.util
import os
from collections.abc import Callable
from typing import Any

SWITCH = "TACTILE_COMPILED"  # 0 in the environment leaves everything to numpy


@functools.cache
def available() -> bool:
    """Return true if loops are to be compiled: numba is installed, and nobody has switched it off."""
    return os.environ.get(SWITCH, "1") != "0" and importlib.util.find_spec("numba") is not None


class Loop:
    """A function that is compiled at its first call; other threads may run while it does."""

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self._function, self._run = function, self._compile_and_run

    def __call__(self, *arguments: Any) -> Any:
        """Run it. Raises ModuleNotFoundError where numba is missing: ask ``available`` first."""
        return self._run(*arguments)

    def _compile_and_run(self, *arguments: Any) -> Any:
        import numba

        # numpy's rules for a division by zero; no fast-math: the same numbers on every machine of a kind.
        # Without the wrapper for callers in C compiling takes a tenth less.
        run = numba.njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)(self._function)
        collects = gc.isenabled()
        gc.disable()  # of the many objects that compiling makes and keeps: another tenth
        try:
            found = run(*arguments)
        finally:
            if collects:
                gc.enable()
        self._run = run
        return found
