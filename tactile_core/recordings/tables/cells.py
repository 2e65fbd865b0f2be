"""Cells of a table: numbers, times of day, and texts, for which the table stores an index."""

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
    """Return the cell's number; None for text, NaN, infinity and Python's 1_000."""
    if "_" in cell:
        return None
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def seconds(cell: str) -> float:
    """Return a time, s since 1970 if it has a day (2012-11-08, 08.11.2012), else since midnight; or ValueError."""
    found = CLOCK.fullmatch(cell.strip())
    if found is None:
        raise ValueError(cell)
    *day_first, hour, minute, second, _, zone, minutes = found.groups()
    year, month, day = day_first[:3] if day_first[0] else day_first[:2:-1]
    days = date(int(year), int(month), int(day)).toordinal() - EPOCH if year else 0
    zoned = float(f"{zone[0]}1") * (60 * int(zone[1:]) + int(minutes)) if zone else 0.0
    return DAY * days + 3600 * int(hour) + 60 * (int(minute) - zoned) + float(second.replace(",", "."))


class Words:
    """Distinct texts of a column; the table stores their indices in place of them."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def number(self, cell: str) -> float:
        """Return the index of a cell's text; a new text gets a new index, after `MOST_WORDS` texts that of `MORE`."""
        word = cell.strip().translate(OUTSIDE)
        if word not in self._numbers and len(self._numbers) >= MOST_WORDS:
            word = MORE
        return float(self._numbers.setdefault(word, len(self._numbers)))

    def texts(self, numbers: np.ndarray) -> np.ndarray:
        """Return the texts (T,) object whose indices are ``numbers`` (T,) float; "" for NaN, a missing cell."""
        known = np.array([*self._numbers, ""], dtype=object)
        return known[np.where(np.isfinite(numbers), numbers, -1).astype(int)]

    def values(self, numbers: np.ndarray) -> np.ndarray:
        """Return the numbers (T,) float that texts of indices ``numbers`` (T,) float spell; NaN for others."""
        known = [value if (value := number(word)) is not None else np.nan for word in (*self._numbers, "")]
        return np.array(known)[np.where(np.isfinite(numbers), numbers, -1).astype(int)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)


class Cells:
    """Kinds of a table's columns: numbers, times or texts.
    words : name of a column of texts -> its distinct texts; plain : true if all columns hold numbers"""

    def __init__(self, names: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Decide by the first `LOOKED_AT` rows, lists of cells, what each of the columns `names` holds."""
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
        """Return a row's cells as numbers: times in s, texts as indices. Raises ValueError for an unreadable cell."""
        if self.plain:
            return [float(cell) for cell in cells]
        return [reader(cell) for reader, cell in zip(self._readers, cells, strict=True)]

    def value(self, place: int, cell: str) -> float | None:
        """Return the number of a cell in column `place`; None if it is not finite, or not of the column's kind."""
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
    """Return a text without its quotation marks; separators between them are replaced until a cell is read."""
    return QUOTED.sub(lambda found: found[1].strip().translate(INSIDE), text).replace('"', "") if '"' in text else text
