"""Cells of a table: numbers, times of day, and texts, which the table stores as their index."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from datetime import date

import numpy as np

LOOKED_AT = 50  # rows, by which it is decided what a column holds (assumed enough)
MOST_WORDS = 10_000  # different texts kept of a column; the others of more become one (assumed enough for labels)
MORE = "..."
CLOCK = re.compile(
    r"(?:(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)|(\d\d?)\.(\d\d?)\.(\d{4}))[T ]+)?"
    r"(\d\d?):(\d\d):(\d\d(?:[.,]\d*)?) ?(?:(Z|UTC)|([+-]\d\d):?(\d\d))?"
)
DAY, EPOCH = 86400.0, date(1970, 1, 1).toordinal()
MISSING = {"", "-", "--", "?", "nan", "none", "null", "na", "n/a", "#n/a", "<na>"}
# Numbers under such names are kept as labels; other numbers that no layout knows are left out.
LABEL = re.compile(
    r"(?:^|[^a-z])(?:label|object|material|texture|class|category|subject|session|trial|task|episode|condition|phase"
    r"|slip|slipped)(?:[^a-z]|$)"
)
QUOTED = re.compile(r'"([^"\n]*)"')
INSIDE = {ord(mark): chr(0xE000 + place) for place, mark in enumerate(",;\t ")}  # separators within quotes, meanwhile
OUTSIDE = {ord(mark): chr(code) for code, mark in INSIDE.items()}


def number(cell: str) -> float | None:
    """Parse the cell as a finite number; None for text, NaN, infinity and Python's 1_000."""
    if "_" in cell:
        return None
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def seconds(cell: str) -> float:
    """Parse a time, with a day (2012-11-08, 08.11.2012) or none, to s since 1970 or midnight; else ValueError."""
    found = CLOCK.fullmatch(cell.strip())
    if found is None:
        raise ValueError(cell)
    *day_first, hour, minute, second, _, zone, minutes = found.groups()
    year, month, day = day_first[:3] if day_first[0] else day_first[:2:-1]
    days = date(int(year), int(month), int(day)).toordinal() - EPOCH if year else 0
    zoned = float(f"{zone[0]}1") * (60 * int(zone[1:]) + int(minutes)) if zone else 0.0
    return DAY * days + 3600 * int(hour) + 60 * (int(minute) - zoned) + float(second.replace(",", "."))


class Words:
    """Distinct texts of a column, which the table stores by their index."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def number(self, cell: str) -> float:
        """Return the index of a cell's text, a new index for a new text; after `MOST_WORDS` texts, that of `MORE`."""
        word = cell.strip().translate(OUTSIDE)
        if word not in self._numbers and len(self._numbers) >= MOST_WORDS:
            word = MORE
        return float(self._numbers.setdefault(word, len(self._numbers)))

    def texts(self, numbers: np.ndarray) -> np.ndarray:
        """Return the texts (T,) object of indices ``numbers`` (T,) float; the empty text for NaN, a missing cell."""
        known = np.array([*self._numbers, ""], dtype=object)
        return known[np.where(np.isfinite(numbers), numbers, -1).astype(int)]

    def values(self, numbers: np.ndarray) -> np.ndarray:
        """Return the numbers (T,) float that texts of indices ``numbers`` (T,) float spell; NaN for other texts."""
        known = [value if (value := number(word)) is not None else np.nan for word in (*self._numbers, "")]
        return np.array(known)[np.where(np.isfinite(numbers), numbers, -1).astype(int)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)


class Cells:
    """Kinds of a table's columns: number, time, text. words : of columns of texts, by name; plain : all numbers"""

    def __init__(self, names: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Decide by the first `LOOKED_AT` rows, lists of cells, what each column holds: numbers, times or words.
        names : of the columns"""
        self.words: dict[str, Words] = {}
        self._readers: list[Callable[[str], float]] = [_plain_number] * len(names)
        for place, name in enumerate(names):
            held = {row[place].strip() for row in rows[:LOOKED_AT] if place < len(row)}
            told = {cell for cell in held if cell.lower() not in MISSING}
            if told and all(_is_clock(cell) for cell in told):
                self._readers[place] = seconds
            elif held and not any(number(cell) is not None for cell in held):
                self.words[name] = Words()
                self._readers[place] = self.words[name].number
        self.plain = all(reader is _plain_number for reader in self._readers)

    def values(self, cells: Sequence[str]) -> list[float]:
        """Read the cells of a row as numbers. Raises ValueError where a number or time cannot be read."""
        if self.plain:
            return [float(cell) for cell in cells]
        return [reader(cell) for reader, cell in zip(self._readers, cells, strict=True)]

    def value(self, place: int, cell: str) -> float | None:
        """Read a cell of column number `place`; None for one that is not finite, or not of the column's kind."""
        try:
            found = self._readers[place](cell)
        except ValueError:
            return None
        return found if np.isfinite(found) else None


def _plain_number(cell: str) -> float:
    if "_" in cell:
        raise ValueError(cell)
    return float(cell)


def _is_clock(cell: str) -> bool:
    try:
        seconds(cell)
    except ValueError:
        return False
    return True


def unquoted(text: str) -> str:
    """Return a text without quotes; separators within them are protected until a cell is read."""
    return QUOTED.sub(lambda found: found[1].strip().translate(INSIDE), text).replace('"', "") if '"' in text else text
