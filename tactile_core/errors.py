"""The one error type shown to users: what is wrong, where, what was expected, what to do."""

from __future__ import annotations

import math
import os
from typing import Any

MOST = 800  # characters of what was found that a message quotes; a library's own may hold a whole line of the file
_HEAD, _TAIL = 600, 150


class TactileError(Exception):
    """Bad input or a job that cannot be done; the command line prints it in one line and exits with code 2.

    where : the file, and row or field in it, such as ``"touch.csv, row 17, ele3"``
    found : what is there
    expected : what should be there
    advice : what the user can do, an imperative sentence
    second : s from the start of a recording, if the error is of one moment in it; else None"""

    second: float | None = None  # of a recording, where the error is of a moment in it

    def __init__(self, where: str | os.PathLike, found: str, expected: str = "", advice: str = "") -> None:
        self.where, self.found, self.expected, self.advice = os.fspath(where), found, expected, advice
        super().__init__(self._sentence())

    def __reduce__(self) -> tuple[type, tuple[str, str, str, str]]:
        """Pickle all fields, so that worker processes pass errors on; by default only the sentence would arrive."""
        return type(self), (self.where, self.found, self.expected, self.advice)

    def _sentence(self) -> str:
        found = " ".join(self.found.split())  # of arrays: in lines
        found = found if len(found) <= MOST else f"{found[:_HEAD]} [...] {found[-_TAIL:]}"
        text = f"{self.where}: {found}"
        if self.expected:
            text += f"; expected {self.expected}"
        if self.advice:
            text += f". {self.advice}"
        return text


def finite_number(
    value: Any, where: str, expected: str, least: float = -math.inf, most: float = math.inf, advice: str = ""
) -> float:
    """Return a value as a float. Raises TactileError, of where, expected and advice, unless it is a finite number from
    ``least`` to ``most``. Decimal and Fraction are refused: numpy's functions fail on those."""
    try:
        known = isinstance(value, int | float) or hasattr(value, "__array__")
        number = float(value) if known and not isinstance(value, bool) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not (math.isfinite(number) and least <= number <= most):
        raise TactileError(where, f"{value!r:.80}", expected, advice)
    return number


def numbers(values: Any, where: str) -> Any:
    """Return values as an array of real numbers. Raises TactileError, which names them ``where``, for anything else."""
    import numpy as np

    if np.ma.is_masked(values):
        raise TactileError(where, "masked values", "a number at every place", "Fill them in, or leave the frame out")
    try:
        array = np.asarray(values)
    except (ValueError, RuntimeError):  # rows of unequal length; a tensor that keeps gradients
        array = np.empty(0, object)
    if array.dtype.kind not in "biuf":
        raise TactileError(where, f"{values!r:.80}", "an array of real numbers")
    return array


def path_text(value: Any, where: str, expected: str = "a file's name", advice: str = "") -> str:
    """Return a file's name as text. Raises TactileError of where, expected, advice for neither text nor a path."""
    if not isinstance(value, str | os.PathLike):
        raise TactileError(where, f"a {type(value).__name__}", expected, advice)
    return os.fspath(value)
