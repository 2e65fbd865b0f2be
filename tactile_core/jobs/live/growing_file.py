"""A text recording that grows: its new rows, each as soon as its line is whole."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ...errors import TactileError
from ...files import outside
from ...recordings.assemble import MAX_BAD_SHARE, BadRows
from ...recordings.fingers import split
from ...recordings.readers import table_reader
from ...recordings.recording import Recording
from ...recordings.tables.column_map import ColumnMap
from ...recordings.tables.table import read_lines, text_lines
from ...recordings.tables.table_header import Header
from ...sensors import SOURCE

MOST = 2**24  # bytes taken at a time, so that a file that is long already costs bounded memory
MAX_LINE = 2**20
FEW = 20  # rows, 0.2 s, of which any number may be bad at once: a program that stumbles, or a cable that is touched


class Growing:
    """A CSV recording that another program is writing, in any of the text layouts."""

    def __init__(self, path: str | os.PathLike, columns: ColumnMap | None = None, sensor: str = SOURCE) -> None:
        """Raise TactileError where there is no such file; columns, sensor : as of `recordings.read`.

        ``path#1`` follows finger 1 of a file of several.
        """
        file, self._finger, _ = split(os.fspath(path))
        self._path, self._columns, self._sensor = Path(file), columns, sensor
        self._place, self._rest, self._lines = 0, b"", 0
        self._header: Header | None = None
        self.rows, self.bad = 0, 0  # that came; of them passed over
        if not self._path.is_file():
            raise TactileError(path, "there is no such file", "a CSV recording that is being written")
        self._file = _identity(self._path.stat())

    def poll(self) -> Recording | None:
        """Return the rows that came since the last call; None where none did, or where too many are bad.

        Raises TactileError for a file that became shorter or another one, for one that is no recording, for a row that
        names another sensor, and where over a fifth of all rows is bad. A bad cell among good rows is NaN.
        """
        data = self._new_bytes()
        whole, end, self._rest = (self._rest + data).rpartition(b"\n")
        if len(self._rest) > MAX_LINE:
            raise TactileError(self._path, f"a line of over {MAX_LINE // 2**20} MB", "a line for each frame")
        if not end:
            return None
        if self._header is None:
            lines = text_lines(str(self._path), whole + end)
            if sum(bool(line.strip()) for line in lines) < 2:  # a comment, perhaps: the next line shows what this is
                self._rest = whole + end + self._rest
                return None
            self._header = Header.parse(str(self._path), lines)
        table = read_lines(str(self._path), self._header, whole + end, self._lines)
        self._lines += whole.count(b"\n") + 1
        if table is None:
            return None
        self.rows += len(table.lines)
        try:
            return table_reader(str(self._path), table.header, self._columns, self._sensor, self._finger)(table)
        except BadRows:
            self.bad += len(table.lines)
            if self.bad > max(FEW, MAX_BAD_SHARE * self.rows):
                raise
            return None

    def _new_bytes(self) -> bytes:
        try:
            found = self._path.stat()
            size = found.st_size
            if size < self._place or _identity(found) != self._file:
                change = "became shorter" if size < self._place else "was replaced by another file"
                raise TactileError(self._path, change, "a file that grows", "Watch the new file")
            if size == self._place:
                return b""
            with outside.open_file(self._path, "a CSV file that grows") as file:
                file.seek(self._place)
                data = file.read(MOST)
        except OSError as error:
            raise TactileError(self._path, error.strerror or str(error), "a readable file") from error
        self._place += len(data)
        return data


def _identity(found: os.stat_result) -> tuple[int, int]:
    """Identity of a file that does not change while it grows."""
    return found.st_dev, found.st_ino


def newest(recording: Recording) -> np.ndarray:
    """Return the counts (19,) of the last whole row; NaN cells are filled from rows before, with 0 where none are."""
    found = np.full(recording.electrodes.shape[1], np.nan)
    for row in recording.electrodes[::-1]:
        found = np.where(np.isfinite(found), found, row)
        if np.isfinite(found).all():
            break
    return np.nan_to_num(found)
