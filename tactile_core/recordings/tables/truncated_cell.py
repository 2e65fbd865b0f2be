"""Check the last cell of a text file that does not end in a newline: it may be cut off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..assemble import Problem

SHOWN = 40  # characters of a cell or header that a message repeats


def shown(text: str) -> str:
    """Quote the text for a message, cut when long."""
    return repr(text if len(text) <= SHOWN else text[:SHOWN] + "…")


def listed(names: Sequence[str], most: int = 8) -> str:
    """List names for a message, the first few (`most`) and the number of the others."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def doubt_last_cell(
    kept: list[tuple[int, str]], header: tuple[str, ...], separator: str, values: np.ndarray, problems: list[Problem]
) -> None:
    """Report the last number of a file without final newline as a problem where it may be cut off: every other row ends
    in a separator and this one does not, or else its value looks cut (`_looks_cut`). Complete files that merely lack it
    are common. kept : number and text of each line; values : (T, C) of them, of which the last becomes NaN"""
    number, line = kept[-1]
    if len(kept) < 2 or line.count(separator) != len(header) - 1 or not np.isfinite(values[-1, -1]):
        return
    closed = kept[-2][1].rstrip(" ").endswith(separator)
    if closed or _looks_cut(values[:, -1]):
        cell = line.split(separator)[-1].strip()
        values[-1, -1] = np.nan
        found = f"the file ends in this cell, {shown(cell)}" + ("" if closed else ", far below the rows before")
        problems.append(Problem(len(kept) - 1, number, header[-1], f"{found} (truncated)"))


def _looks_cut(column: np.ndarray) -> bool:
    """Return true if the last value of a column (T,) looks like the first digits of a longer number: below half the
    value before (assumed; a missing digit makes a count ten times smaller), and no step in the column is as large. A
    signal that swings around 0 passes; lost decimals change little."""
    before = column[:-1][np.isfinite(column[:-1])]
    if not len(before) or abs(column[-1]) >= 0.5 * abs(before[-1]):
        return False
    return bool(abs(column[-1] - before[-1]) > np.abs(np.diff(before)).max(initial=0.0))
