"""Compile loops by numba, which the extras [fem] and [fast] bring.

A loop is written once, as plain Python over arrays. numba is imported at its first call; compiled code is kept on disk,
beside the source or in the user's cache, for the next process. Without numba the same lines run uncompiled and give the
same numbers: contacts then take five to twenty-five times as long."""

from __future__ import annotations

import functools
import gc
import importlib.util
import os
from collections.abc import Callable
from typing import Any

SWITCH = "TACTILE_COMPILED"  # 0 in the environment compiles nothing


@functools.cache
def available() -> bool:
    """Return true if loops are to be compiled: numba is installed, and nobody has switched it off."""
    return os.environ.get(SWITCH, "1") != "0" and importlib.util.find_spec("numba") is not None


def add_scaled(total: Any, factor: Any, line: Any) -> None:
    """Add ``factor`` times an array (n,) to ``total`` (n,), in place; in loops compiled without a copy."""
    total += factor * line


@functools.cache
def _teach_numba() -> None:
    """Give numba an ``add_scaled`` of our own: the one it compiles by itself takes twice as long."""
    import numba.extending

    @numba.extending.overload(add_scaled)
    def _add_scaled(total, factor, line):  # noqa: ANN001, ANN202
        def add(total, factor, line) -> None:  # noqa: ANN001
            for j in range(len(total)):
                total[j] += factor * line[j]

        return add


class Loop:
    """A function that is compiled at its first call; other threads may run during the compilation."""

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self._function, self._run = function, self._compile_and_run

    def __call__(self, *arguments: Any) -> Any:
        """Run it, uncompiled where numba is missing or switched off."""
        return self._run(*arguments) if available() else self._function(*arguments)

    def _compile_and_run(self, *arguments: Any) -> Any:
        import numba

        _teach_numba()
        # What is kept on disk names this package's modules. In Blender they have other names: each keeps its own.
        self._function.__qualname__ = f"{__package__}.{self._function.__qualname__}"
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
