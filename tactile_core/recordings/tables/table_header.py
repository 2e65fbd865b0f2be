"""Header of a text table: names, separator, and the comments before. Columns of a table without header are numbered."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from ...errors import TactileError
from ...files.short_text import shown
from .cells import INSIDE, LOOKED_AT, OUTSIDE, Cells, number

MAX_COLUMNS = 1000  # the widest layout has 50 (assumed enough)
COMMENTS = "#", "%", "//"
SPACE = " "  # stands for any white space between cells
MANY = 10  # cells: a first line of less than half as many as one soon after it is a title, no header (assumed)
DECIMAL_COMMA = re.compile(rf"(\s*[-+]?\d*)[,{INSIDE[ord(',')]}](\d+(?:[eE][-+]?\d+)?\s*)")  # a quoted one, too
NUMBERED = "column{}"  # names of columns without a header, from 1


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
            raise TactileError(f"{path}, line {line + 1}", f"column {shown(name)} is there twice", "each column once")
    return names
