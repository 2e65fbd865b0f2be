"""Parse text tables; every bad cell is reported with its line and column."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import BinaryIO

import numpy as np

from ...errors import TactileError
from ..assemble import MAX_FRAMES, MAX_PROBLEMS, Problem
from ..labels import labels_of
from .cells import LABEL, MISSING, Header, Words, split, unquoted
from .rows import clean, doubt_last_cell, is_row, no_number, row, tell_blank_lines

MAX_BYTES = 512 * 2**20  # of text, about 7 hours of the widest layout; bounds memory (assumed enough)
MAX_LINE = 2**20  # bytes; the widest layout has 500 per line (assumed enough)
WHOLE = 8 * 2**20  # bytes of text up to which a file is parsed at once; of a longer one BLOCK at a time
BLOCK = 2 * 2**20
OVERLAP = 200  # rows of the block before by which the last cell of a file is judged


@dataclass(frozen=True, eq=False)
class Table:
    """Table parsed from a text, or made of arrays.

    header : names of the columns; values : (T, C) float, NaN at bad cells; lines : (T,) int, each row's line in the
    file
    problems : bad cells; exact : index of a column that float32 would round, such as time stamps -> (T,) float64
    start : number of the line after which the rows begin
    left_out : names of columns that were parsed and not kept
    taken : names of columns that were read so far, or belong to another recording in the file
    words : name of a column of texts -> its distinct texts, whose indices are in `values`
    texts : name -> (T,) labels that the file has beside its columns"""

    path: str
    header: tuple[str, ...]
    values: np.ndarray
    lines: np.ndarray
    problems: tuple[Problem, ...]
    warnings: tuple[str, ...] = ()
    exact: dict[int, np.ndarray] = field(default_factory=dict)
    start: int = 0
    left_out: frozenset[str] = frozenset()
    taken: set[str] = field(default_factory=set)
    words: dict[str, Words] = field(default_factory=dict)
    texts: dict[str, np.ndarray] = field(default_factory=dict)

    def columns(self, names: list[str], dtype: type = np.float64) -> np.ndarray:
        """Return columns `names` as numbers (T, n) of a dtype. Raises TactileError for a missing one, or texts."""
        missing = [name for name in names if not self.has(name)]
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            raise TactileError(
                f"{self.path}, line 1",
                f"column {missing[0]!r}{more} is missing",
                f"{names[0]} .. {names[-1]}" if len(names) > 1 else names[0],
                "Export all columns, or name those there are in a map: tactile info FILE --columns map.toml writes one",
            )
        self.taken.update(names)
        found: np.ndarray = np.empty((len(self.values), len(names)), dtype)
        with np.errstate(over="ignore"):
            for place, column in enumerate(self.header.index(name) for name in names):
                values = self.exact.get(column, self.values[:, column])
                words = self.words.get(self.header[column])
                found[:, place] = values if words is None else self._numbers_of(names[place], words, values)
        return found

    def _numbers_of(self, name: str, words: Words, values: np.ndarray) -> np.ndarray:
        """Return the numbers (T,) in column `name` of texts. Raises TactileError if none is. words, values : distinct
        texts, and (T,) float, the rows' indices in these"""
        found, told = words.values(values), [word for word in words if word.lower() not in MISSING]
        if told and not np.isfinite(found).any():
            expected = "numbers as 3315 or 3.315, or times as 2012-11-08 17:12:03.45"
            advice = "Export them so, or leave the column out in a map: tactile info FILE --columns map.toml writes one"
            line = self.lines[(words.texts(values) == told[0]).argmax()]
            raise TactileError(f"{self.path}, line {line}, column {name!r}", no_number(told[0]), expected, advice)
        return found

    def labels(self, used: Collection[str]) -> dict[str, np.ndarray]:
        """Return labels, name -> (T,) texts: columns of texts not used, and of numbers with a label's usual name."""
        found = dict(self.texts)
        for column, name in enumerate(self.header):
            values = self.exact.get(column, self.values[:, column])
            if name in self.words and name not in used:
                found[name] = self.words[name].texts(values)
            elif name not in used and LABEL.search(name):
                found[name] = np.array(["" if np.isnan(value) else f"{value:.10g}" for value in values], dtype=object)
        self.taken.update(found)
        return labels_of(found)

    def counts(self, names: list[str]) -> np.ndarray:
        """Return columns `names` (T, n), float32 if exact, NaN if missing. Raises TactileError if half are missing."""
        self.taken.update(names)
        held = [name for name in names if self.has(name)]
        if len(held) < len(names) and len(held) > len(names) / 2:
            found = np.full((len(self.values), len(names)), np.nan)
            found[:, [names.index(name) for name in held]] = self.columns(held)
            return found
        places = [self.header.index(name) for name in names if name in self.header]
        if not self.left_out or any(place in self.exact for place in places):
            return self.columns(names)
        if places == list(range(places[0], places[0] + len(names))) and self.values.dtype == np.float32:
            return self.values[:, places[0] : places[0] + len(names)]  # no copy: it may be most of the table
        return self.columns(names, np.float32)

    def has(self, name: str) -> bool:
        """Return true if the file has the column."""
        return name in self.header or name in self.left_out

    def column(self, name: str) -> np.ndarray:
        """Return the column `name` as numbers (T,) float."""
        return self.columns([name])[:, 0]

    def essential(self, names: Iterable[str], also: Iterable[str] = ()) -> list[Problem]:
        """Return the problems in the columns `names`, marked essential, and those in columns `also`, marked not so."""
        keep, read = {*names, "row"}, {*names, "row", *also}
        return [replace(p, essential=p.field in keep) for p in self.problems if p.field in read]


def read_lines(path: str, header: Header, data: bytes, before: int) -> Table | None:
    """Return the table in whole lines of a growing file, after `before` earlier lines; None if they hold no row."""
    lines = text_lines(path, data)
    skipped = max(0, header.lines - before)
    if not any(line.strip(" \t") for line in lines[skipped:]):
        return None
    return _parsed(path, header, lines[skipped:], before + skipped, last=False)


def read_header(path: str, file: BinaryIO) -> tuple[str, ...]:
    """Return the names of the file's columns, in lower case, from its first megabyte."""
    file.seek(0)
    return Header.parse(path, text_lines(path, _whole_lines(path, file, file.read(MAX_LINE)))).names


def read_table(path: str, file: BinaryIO, left_out: Callable[[str], bool] | None = None) -> Table:
    """Return the table in a file. Raises TactileError if it is no text, or too long, or lacks rows, or has two columns
    of one name.
    left_out : function that is true for the name of a column that files of over `WHOLE` bytes need not keep"""
    size = os.fstat(file.fileno()).st_size
    if size > MAX_BYTES:
        found, advice = f"more than {MAX_BYTES // 2**20} MB of text", "Split it, or read it in parts: `tactile batch`"
        raise TactileError(path, found, "a recording of some hours", advice)
    blocks = read_tables(path, file, WHOLE if size <= WHOLE else BLOCK, OVERLAP)
    first, _ = next(blocks)
    return first if size <= WHOLE else _joined(first, blocks, size, left_out or (lambda name: False))


def _joined(first: Table, blocks: Iterator[tuple[Table, int]], size: int, left_out: Callable[[str], bool]) -> Table:
    """Return a file's blocks as one table, float32 if exact. size : bytes of the file; left_out : see `read_table`"""
    path = first.path
    held = [column for column, name in enumerate(first.header) if name in first.words or not left_out(name)]
    header = tuple(first.header[column] for column in held)
    guess = int(1.05 * len(first.values) * size / BLOCK) + 1000
    values, lines = np.empty((guess, len(header)), np.float32), np.empty(guess, int)
    exact: dict[int, list[tuple[int, np.ndarray]]] = {}
    problems: list[Problem] = []
    count = 0
    for table, repeated in chain([(first, 0)], blocks):
        block = table.values[repeated:, held]
        end = count + len(block)
        if end > MAX_FRAMES:
            raise TactileError(path, f"over {MAX_FRAMES:,} data rows", f"at most {MAX_FRAMES:,}", "Split the recording")
        if end > len(values):
            more = end - len(values) + guess // 8
            values = np.concatenate([values, np.empty((more, len(header)), np.float32)])
            lines = np.concatenate([lines, np.empty(more, int)])
        with np.errstate(over="ignore"):
            values[count:end] = block
        lines[count:end] = table.lines[repeated:]
        rounded = (values[count:end] != block) & ~np.isnan(block)
        for column in np.flatnonzero(rounded.any(axis=0)).tolist():
            exact.setdefault(column, []).append((count, block[:, column].copy()))
        shift = count - repeated
        problems += [replace(one, frame=one.frame + shift) for one in table.problems if one.frame >= repeated]
        _check_problems(path, problems, int(table.lines[-1]))
        count = end
    values, lines = values[:count], lines[:count]
    columns = {}
    for column, parts in exact.items():
        columns[column] = values[:, column].astype(float)
        for start, part in parts:
            columns[column][start : start + len(part)] = part
    blank = tell_blank_lines(first.start, lines)
    return Table(
        path, header, values, lines, tuple(problems), blank, columns,
        left_out=frozenset({*first.header} - {*header}), words=first.words,
    )  # fmt: skip


def _check_problems(path: str, problems: list[Problem], line: int) -> None:
    if len(problems) > MAX_PROBLEMS:
        first = problems[0]
        found = f"{first.found}; more than {MAX_PROBLEMS:,} bad cells up to line {line}"
        where = f"{path}, line {first.row}, {first.field}"
        raise TactileError(where, found, "numbers", "Check the export of this file")


def read_tables(path: str, file: BinaryIO, part_bytes: int, context: int) -> Iterator[tuple[Table, int]]:
    """Yield pairs (table, repeated) of a file, in parts of about `part_bytes` of text; `repeated` first rows of a part,
    at most `context`, are the last of the part before. Raises TactileError for the same files as `read_table`."""
    file.seek(0)
    data = _whole_lines(path, file, file.read(part_bytes))
    lines = text_lines(path, data)
    header = Header.parse(path, lines)
    first = header.lines
    lines, repeated = lines[first:], 0
    while True:
        data = _whole_lines(path, file, file.read(part_bytes))
        last = not data
        table = _parsed(path, header, lines, first, last)
        yield table, repeated
        if last:
            return
        repeated = min(context, len(table.lines))
        kept = int(table.lines[-repeated]) - first - 1
        lines, first = lines[kept:-1] + text_lines(path, data), first + kept


def _whole_lines(path: str, file: BinaryIO, data: bytes) -> bytes:
    """Return data, bytes of a file, up to the end of their last line. Raises TactileError for a long line."""
    if data and not data.endswith(b"\n"):
        data += file.readline(MAX_LINE)
        if not data.endswith(b"\n") and file.read(1):
            raise TactileError(path, f"a line of over {MAX_LINE // 2**20} MB", "a line for each frame")
    return data


def _parsed(path: str, header: Header, lines: list[str], first: int, last: bool = True) -> Table:
    """Return the table in the lines that follow line number `first`; last : true if the file ends with them."""
    ended = not lines or not lines[-1]
    if ended:
        lines = lines[:-1]
    kept = [(number, line) for number, line in enumerate(lines, start=first + 1) if is_row(line, header)]
    if not kept:
        advice = "Check that the recording was written to its end"
        raise TactileError(path, "a header without data rows", "at least one frame", advice)
    problems: list[Problem] = []
    rows = [line for _, line in kept]
    cells = header.cells(rows)
    values = clean(rows, header) if cells.plain else None
    if values is None:
        values = np.empty((len(kept), len(header.names)))
        for frame, (line_number, line) in enumerate(kept):
            values[frame] = row(line, header, cells, frame, line_number, problems)
            _check_problems(path, problems, line_number)
        for frame in sorted({problem.frame for problem in problems}):
            found = [cell.strip().lower() for cell in split(rows[frame], header.separator)]
            if found != [*header.names] and len({*found} & {*header.names}) > len(header.names) / 2:
                where = f"{path}, line {kept[frame][0]}"
                raise TactileError(where, "another header", "columns as above", "Split the file there")
    if last and not ended and header.names[-1] not in cells.words:
        doubt_last_cell(kept, header.names, header.separator, values, problems)
    numbers = np.array([line_number for line_number, _ in kept])
    blank = tell_blank_lines(first, numbers)
    return Table(path, header.names, values, numbers, tuple(problems), blank, start=first, words=cells.words)


def text_lines(path: str, data: bytes) -> list[str]:
    """Return the lines of a file's text, with an empty one after its last newline. Raises TactileError, on the file
    `path`, for bytes that are no UTF-8 text, and for a line of over `MAX_LINE` characters."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise TactileError(path, "UTF-16 text", "UTF-8 text", "Save the file as UTF-8 (in a spreadsheet: CSV UTF-8)")
    if b"\0" in data:
        expected, advice = "a CSV, HDF5, NPZ or MATLAB 5 recording", "Write tables as CSV, arrays by numpy.savez"
        raise TactileError(f"{path}, byte {data.index(0)}", "binary data", expected, advice)
    try:
        text = unquoted(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        where, advice = f"{path}, byte {error.start}", "Save a text file as UTF-8"
        raise TactileError(where, "not UTF-8 text", "a CSV, HDF5, NPZ or MATLAB 5 recording", advice) from None
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if max(map(len, lines)) > MAX_LINE:
        raise TactileError(path, f"a line of over {MAX_LINE // 2**20} MB", "a line for each frame")
    return lines
