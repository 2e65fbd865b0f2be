"""Header and cells of a text table: names, separator and comments before; numbers, times of day, and texts, for which
the table stores an index. Columns of a table without header are numbered."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import date

import numpy as np

from ...errors import TactileError
from ...files.short_text import shown

LOOKED_AT = 50  # rows, by which it is decided what a column holds (assumed enough)
MOST_WORDS = 10_000  # different texts kept of a column; the others of more become one (assumed enough for labels)
MORE = "..."
CLOCK = re.compile(
    r"(?:(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)|(\d\d?)\.(\d\d?)\.(\d{4}))[T ]+)?"
    r"(\d\d?):(\d\d):(\d\d(?:[.,]\d*)?) ?(?:(Z|UTC)|([+-]\d\d)(?::?(\d\d))?)?"
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
MAX_COLUMNS = 1000  # the widest layout has 50 (assumed enough)
COMMENTS = "#", "%", "//"
SPACE = " "  # stands for any white space between cells
MANY = 10  # cells: a first line of less than half as many as one soon after it is a title, no header (assumed)
DECIMAL_COMMA = re.compile(rf"(\s*[-+]?\d*)[,{INSIDE[ord(',')]}](\d+(?:[eE][-+]?\d+)?\s*)")  # a quoted one, too
NUMBERED = "column{}"  # names of columns without a header, from 1


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
    zoned = float(f"{zone[0]}1") * (60 * int(zone[1:]) + int(minutes or 0)) if zone else 0.0
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


@dataclass
class Header:
    """Header of a table. names : the columns' names, in lower case; lines : number of lines up to the header, with it
    separator : character between cells; line : text of the header, "" if it is a comment or missing"""

    names: tuple[str, ...]
    lines: int
    separator: str
    line: str = ""
    _cells: Cells | None = field(default=None, init=False)

    @classmethod
    def parse(cls, path: str, lines: Sequence[str]) -> Header:
        """Return the header of a text that starts with these lines. Comments before the rows are skipped, except the
        last one if it names the columns, as in files of ``np.savetxt`` and ``rostopic echo -p``.
        Raises TactileError, on the file `path`, for a text without a line, too many columns, or two of one name."""
        first, comment = _first_row(lines)
        if first is None:
            raise TactileError(path, "an empty file", "a recording", "Check that the recording was written to its end")
        separator = _separator(lines[first])
        cells = _cells(lines[first], separator)
        if len(cells) > MAX_COLUMNS:
            found = f"{len(cells):,} columns"
            raise TactileError(f"{path}, line {first + 1}", found, f"at most {MAX_COLUMNS:,}", "Export it again")
        if comment is not None and len(above := _cells(lines[comment].lstrip("#%/ \t"), separator)) == len(cells) > 1:
            return cls(_names(path, above, comment), first, separator)
        if _is_data(cells):
            return cls(tuple(NUMBERED.format(place + 1) for place in range(len(cells))), first, separator)
        return cls(_names(path, cells, first), first + 1, separator, lines[first])

    def cells(self, rows: Sequence[str]) -> Cells:
        """Return the kinds of the columns, which the first `rows` (lines) ever given decide."""
        if self._cells is None:
            self._cells = Cells(self.names, [split(row, self.separator) for row in rows[:LOOKED_AT]])
        return self._cells


def split(line: str, separator: str) -> list[str]:
    """Return a line's cells; decimal commas become points, unless the comma is the separator."""
    cells = line.split() if separator == SPACE else line.split(separator)
    if separator == "," or not ("," in line or INSIDE[ord(",")] in line):
        return cells
    return [f"{comma[1]}.{comma[2]}" if (comma := DECIMAL_COMMA.fullmatch(cell)) else cell for cell in cells]


def _first_row(lines: Sequence[str]) -> tuple[int | None, int | None]:
    """Return the index of the first line but comments and titles, and of the last comment before, or None."""
    filled = [place for place, line in enumerate(lines) if line.strip()]
    first = next((place for place in filled if not lines[place].lstrip().startswith(COMMENTS)), None)
    if first is None:
        return (filled[0] if filled else None), None
    comment = max((place for place in filled if place < first), default=None)
    near = ((place, lines[place]) for place in filled if first <= place <= first + LOOKED_AT)
    widths = {place: len(_cells(line, _separator(line))) for place, line in near}
    # Lines before one that is twice as wide are a title.
    wide = (place for place, width in widths.items() if width >= max(MANY, 2 * widths[first] + 1))
    return next(wide, first), comment


def _separator(line: str) -> str:
    """Return the separator of cells: semicolon or tab, unless cells have several commas, then comma, or space."""
    commas = line.count(",")
    return next((mark for mark in ";\t" if mark in line and commas <= line.count(mark) + 1), "," if commas else SPACE)


def _cells(line: str, separator: str) -> list[str]:
    cells = [cell.strip() for cell in split(line, separator)]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def _is_data(cells: Sequence[str]) -> bool:
    """Return true if most cells are numbers, unless they count up from 0 or 1, as pandas names columns."""
    values = [value for cell in cells if (value := number(cell)) is not None]
    counts = len(values) > 1 and values[0] in (0, 1) and values == [values[0] + step for step in range(len(values))]
    return len(values) > len([cell for cell in cells if cell]) // 2 and not (counts and len(values) >= MANY)


def _names(path: str, cells: Sequence[str], line: int) -> tuple[str, ...]:
    names = tuple(cell.translate(OUTSIDE).lower() for cell in cells)
    for place, name in enumerate(names):
        if name and name in names[:place]:
            where, found = f"{path}, line {line + 1}", f"column {shown(name)} is there twice"
            raise TactileError(where, found, "each column once", "Rename or remove one")
    return names
