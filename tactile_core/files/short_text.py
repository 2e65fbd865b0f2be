"""Shorten texts: what messages quote, and results that hold large arrays, for ``print`` and notebooks."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

SHOWN = 40  # characters of a cell or header that a message repeats
LONGEST = 9  # numbers: an array up to this long (a force, a rotation) is written out


def shown(text: str) -> str:
    """Return the text quoted for a message, cut if it is long."""
    return repr(text if len(text) <= SHOWN else text[:SHOWN] + "…")


def listed(names: Sequence[str], most: int = 8) -> str:
    """Return names joined by commas for a message: the first `most`, then how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


class Summary:
    """Base of dataclasses with large arrays (declare them with ``repr=False``): prints one line for each field.

    >>> print(tactile.solve("digit", ball, place, force=2.0))
    Solution
      tier           'fast'
      displacement   (2867, 3) float64, -0.000971 to 0.00012
      force          [0.00049 2 -7.4e-09]
    """

    def __repr__(self) -> str:
        """Return the class and its fields, arrays as shape, type and range, without those that are None or hidden."""
        fields = [field.name for field in dataclasses.fields(self) if field.repr]  # type: ignore[arg-type]
        held = {name: value for name in fields if (value := getattr(self, name)) is not None}
        width = max(map(len, held), default=0)
        lines = [f"  {name:{width}}  {_describe(value)}" for name, value in held.items()]
        return "\n".join([type(self).__name__, *lines])


def _describe(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return _describe_array(value)
    if isinstance(value, Summary):
        return repr(value).replace("\n", "\n    ")
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return f"dict of {', '.join(map(str, value))}" if value else "{}"
    return repr(value)


def _describe_array(array: np.ndarray) -> str:
    if array.size <= LONGEST and array.ndim == 1:
        return np.array2string(array, precision=4, max_line_width=200)
    text = f"{array.shape} {array.dtype}"
    if array.dtype == bool:
        return f"{text}, {np.count_nonzero(array)} true"
    if array.size == 0 or array.dtype.kind not in "iuf":
        return text
    if array.dtype.kind != "f":
        return f"{text}, {array.min()} to {array.max()}"
    known = array[~np.isnan(array)]
    missing = f", {array.size - known.size} NaN" if known.size < array.size else ""
    return f"{text}, {known.min():.4g} to {known.max():.4g}{missing}" if known.size else f"{text}, all NaN"
