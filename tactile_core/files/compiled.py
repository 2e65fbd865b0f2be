"""Compile loops by numba, which the extras [fem] and [fast] bring.

A loop is written once, as plain Python over arrays. numba is imported at its first call; compiled code is kept on disk,
beside the source or in the user's cache, for the next process; where neither can be written, or it is damaged, each
process compiles anew. Without numba the same lines run uncompiled and give the same numbers, but for the last bits of
cos, sin and exp: contacts then take five to twenty-five times as long. Short calls of a loop that was never compiled on
a machine run so, too, for a while: compiling takes as long as hundreds."""

from __future__ import annotations

import functools
import gc
import importlib.util
import os
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

SWITCH = "TACTILE_COMPILED"  # in the environment: 0 compiles nothing, 1 each loop at its first call

# A loop that is not on disk yet is compiled once it has run so long, s of CPU, or at an array of so many values.
_PATIENCE, _LARGE = 0.1, 20_000
_ROUNDED_OTHERWISE = {"cos", "sin", "exp", "arcsinh"}  # in their last bits, by numpy and by compiled code


@functools.cache
def available() -> bool:
    """Return true if loops are to be compiled: numba is installed, and TACTILE_COMPILED is not 0."""
    return os.environ.get(SWITCH, "1") != "0" and importlib.util.find_spec("numba") is not None


def add_scaled(total: Any, factor: Any, line: Any) -> None:
    """Add ``factor`` times line (n,) to ``total`` (n,) in place, without a copy in compiled loops."""
    total += factor * line


@functools.cache
def _teach_numba() -> None:
    """Make numba compile ``add_scaled`` to a plain loop: what it makes by itself takes twice as long."""
    import numba.extending

    @numba.extending.overload(add_scaled)
    def _add_scaled(total, factor, line):  # noqa: ANN001, ANN202
        def add(total, factor, line) -> None:  # noqa: ANN001
            for j in range(len(total)):
                total[j] += factor * line[j]

        return add


class Loop:
    """A function that numba compiles once that pays; other threads may run during the compilation.

    waits : false to compile it at its first call, for loops that may run long whatever the size of their arrays
    The function must hold no ``**``: compiled code rounds powers otherwise."""

    def __init__(self, function: Callable[..., Any], *, waits: bool = True) -> None:
        functools.update_wrapper(self, function)
        # What is kept on disk names this package's modules. In Blender they have other names: each keeps its own.
        function.__qualname__ = f"{__package__}.{function.__qualname__}"
        self._waits = waits
        self._function, self._run = function, self._first_call
        self._spent = 0.0  # s, uncompiled
        self._kept = True  # its compiled code, on disk

    def __call__(self, *arguments: Any) -> Any:
        """Run the function, not compiled if numba is missing or switched off, or as long as compiling does not pay."""
        kept = self._kept  # another thread may find out meanwhile
        try:
            return self._run(*arguments) if available() else self._function(*arguments)
        except SystemError as error:  # in which numba wraps, once or twice, what a signal's handler raised
            first: BaseException = error
            while first.__cause__ is not None:
                first = first.__cause__
            raise first from None
        except Exception as error:  # of numba's cache: nowhere to write, a full disk, damage
            passed = (frame.f_code.co_filename for frame, _ in traceback.walk_tb(error.__traceback__))
            if not (kept and any(Path(file).name == "caching.py" for file in passed)):
                raise
            self._kept, self._run = False, self._first_call
            return self(*arguments)

    def _first_call(self, *arguments: Any) -> Any:
        import numba

        _teach_numba()
        # numpy's rules for a division by zero; no fast-math: the same numbers on every machine of a kind.
        # Without the wrapper for callers in C compiling takes a tenth less.
        self._compiled = numba.njit(cache=self._kept, nogil=True, error_model="numpy", no_cfunc_wrapper=True)(
            self._function
        )
        self._run = self._compile_and_run if self._never_waits() else self._run_or_compile
        return self._run(*arguments)

    def _never_waits(self) -> bool:
        """Return true if its compiled code is on disk, it must not wait, or plain Python would give other bits."""
        import numpy as np

        exact = np.lib.NumpyVersion(np.__version__) >= "2.0.0"  # before, a float32 times a number was a float64
        rounded_otherwise = not exact or _ROUNDED_OTHERWISE.intersection(self._function.__code__.co_names)
        if rounded_otherwise or not self._waits or SWITCH in os.environ:
            return True
        if not self._kept:
            return False
        return any(Path(self._compiled.stats.cache_path).glob(f"*{self._function.__qualname__}-*.nbi"))

    def _run_or_compile(self, *arguments: Any) -> Any:
        if self._spent > _PATIENCE or max(getattr(each, "size", 0) for each in arguments) > _LARGE:
            return self._compile_and_run(*arguments)
        import numpy as np

        start = time.thread_time()
        with np.errstate(all="ignore"):  # compiled loops warn of nothing
            found = self._function(*arguments)
        self._spent += time.thread_time() - start
        return found

    def _compile_and_run(self, *arguments: Any) -> Any:
        collects = gc.isenabled()
        gc.disable()  # of the many objects that compiling makes and keeps: another tenth
        try:
            found = self._compiled(*arguments)
        finally:
            if collects:
                gc.enable()
        self._run = self._compiled
        return found
