"""Parse the rows of a text table: clean rows all at once, others cell by cell, with a problem noted for each bad cell.
The last cell of a file without a final newline may be cut off, and is judged."""

from __future__ import annotations

import re
from itertools import islice, pairwise

import numpy as np

from ...files.short_text import shown
from ..assemble import Problem
from .cells import COMMENTS, OUTSIDE, SPACE, Cells, Header, number, split

LARGEST = 1e300  # of a number that a cell may hold, so that sums of several are finite
THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:([,.'’_\s])\d{3})(?:\1\d{3})*(?:[.,]\d+)?")
MAX_BLANK = 8  # blank lines that a message names


def is_row(line: str, header: Header) -> bool:
    """Return false for a line that is blank, a comment, or the header again (of a log that was continued)."""
    return line != header.line and bool(line.strip(" \t")) and not line.lstrip().startswith(COMMENTS)


def clean(rows: list[str], header: Header) -> np.ndarray | None:
    """Return the numbers (n, columns) in n rows; None if any cell is no finite number. Ten times as fast as `row`."""
    trimmed = [row.removesuffix(header.separator) for row in rows]  # one at the end of each row, as the slide set has
    if not all(map(str.strip, trimmed)):
        return None
    try:
        delimiter = None if header.separator == SPACE else header.separator
        values = np.loadtxt(trimmed, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None
    whole = values.shape == (len(rows), len(header.names))
    return values if whole and bool((np.abs(values) < LARGEST).all()) else None  # false for NaN and infinity


def row(line: str, header: Header, kinds: Cells, frame: int, line_number: int, problems: list[Problem]) -> list[float]:
    """Return a line's values, NaN for bad cells, which are added to problems, at `frame` and `line_number`."""
    width = len(header.names)
    cells = split(line, header.separator)
    if len(cells) > width and not "".join(cells[width:]).strip():
        cells = cells[:width]  # a separator at the end of each row, as the slide set has
    if len(cells) == width and (kinds.words or "_" not in line):
        try:
            values = kinds.values(cells)
        except ValueError:
            values = []
        if values and all(-LARGEST < value < LARGEST for value in values):  # false for NaN and infinity
            return values
    return _bad_row(cells, header, kinds, frame, line_number, problems)


def _bad_row(
    cells: list[str], header: Header, kinds: Cells, frame: int, line_number: int, problems: list[Problem]
) -> list[float]:
    names, width = header.names, len(header.names)
    if len(cells) > width:
        within = " (commas within numbers?)" if header.separator == "," else ""
        found = f"{len(cells)} cells where the header has {width}{within}"
        problems.append(Problem(frame, line_number, "row", found))
        return [np.nan] * width
    if len(cells) < width:  # the last cell that is there may be cut in its middle
        problems.append(Problem(frame, line_number, "row", f"ends after {len(cells)} of {width} cells (truncated)"))
        cells = cells[:-1]
    values = []
    for place, (name, cell) in enumerate(zip(names, cells, strict=False)):
        value = kinds.value(place, cell)
        if value is None or not -LARGEST < value < LARGEST:
            plain = cell.strip().translate(OUTSIDE)
            found = no_number(plain) if plain else "an empty cell"
            problems.append(Problem(frame, line_number, name, found))
            value = np.nan
        values.append(value)
    return values + [np.nan] * (width - len(values))


def no_number(cell: str) -> str:
    """Describe in words a cell that is no number; a decimal comma and thousands separators are named."""
    comma = cell.count(",") == 1 and number(cell.replace(",", ".")) is not None
    if THOUSANDS.fullmatch(cell):
        return f"{shown(cell)} is a number with thousands separators{' or a decimal comma' * comma}"
    is_what = "a number with a decimal comma, where a point is expected" if comma else "not a number"
    return f"{shown(cell)} is {is_what}"


def tell_blank_lines(header_line: int, rows: np.ndarray) -> tuple[str, ...]:
    """Return a tuple of one sentence on lines without a frame between header and last row, an empty one if none.
    header_line : line of the header; rows : (T,) int, line of each frame"""
    count = int(rows[-1]) - header_line - len(rows)
    if count == 0:
        return ()
    lines = [header_line, *rows.tolist()]
    blank = (line for before, after in pairwise(lines) for line in range(before + 1, after))
    where = ", ".join(map(str, islice(blank, MAX_BLANK))) + " …" * (count > MAX_BLANK)
    if count == 1:
        return (f"line {where}: blank, a comment or the header again; no frame is made of it",)
    return (f"lines {where}: blank, comments or the header again ({count} in all); no frames are made of them",)


def doubt_last_cell(
    kept: list[tuple[int, str]], header: tuple[str, ...], separator: str, values: np.ndarray, problems: list[Problem]
) -> None:
    """Add the last number of a file without a final newline to problems, and make it NaN, if it may be cut off: if
    other rows end in a separator and this one does not, or if it falls below half of the number above it. (Many whole
    files lack that newline.) kept : number and text of each line; values : (T, C) numbers in these lines"""
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
