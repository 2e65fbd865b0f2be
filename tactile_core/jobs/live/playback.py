"""Feed a view the rows of a growing recording, or of a finished one at its own pace, and show what it draws."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ...errors import TactileError
from ...files import outside
from ...recordings.assemble import MAX_BAD_SHARE, BadRows
from ...recordings.chunks import read_parts
from ...recordings.readers import table_reader
from ...recordings.recording import Recording, split
from ...recordings.tables.cells import Header
from ...recordings.tables.column_map import ColumnMap
from ...recordings.tables.table import read_lines, text_lines
from ...sensors import SOURCE
from .digit_camera import DigitCamera
from .live_view import Shown, View

MOST = 2**24  # bytes taken at a time, so that a file that is long already costs bounded memory
MAX_LINE = 2**20
LAST = 256  # bytes by which a file is known that grew
# Rows, 0.3 s, that come together at first, so that their stamps tell the rate, and of which any number may be bad at
# once: a program that stumbles, or a cable that is touched.
FEW = 30
PATIENCE = 5.0  # s after which fewer of them are shown as well


class Growing:
    """A CSV recording that another program is writing, in any of the text layouts.
    rows, bad, held : number of rows read so far, of bad ones among them, and of first ones that wait for more"""

    def __init__(self, path: str | os.PathLike, columns: ColumnMap | None = None, sensor: str = SOURCE) -> None:
        """Follow a CSV file, or finger 1 of it by ``path#1``. columns : map of its columns; sensor : name of its sensor
        Raises TactileError if there is no such file."""
        file, self._finger, _ = split(os.fspath(path))
        self._path, self._columns, self._sensor = Path(file), columns, sensor
        self._place, self._rest, self._lines, self._last = 0, b"", 0, b""
        self._header: Header | None = None
        self.rows, self.bad, self.held = 0, 0, 0
        if not self._path.is_file():
            raise TactileError(path, "there is no such file", "a CSV recording that is being written")
        self._file = self._path.stat()

    def poll(self, *, last: bool = False) -> Recording | None:
        """Return the rows since the last call, at first some together; None if there are none, or too many are bad.
        last : true if the first rows are not waited for any longer, as if no more come

        Raises TactileError for a file that became shorter, was written anew or is another one, for one that is no
        recording, for a row of another sensor, and if over a fifth of all rows is bad. A bad cell among good
        rows is NaN."""
        data = self._new_bytes()
        if not (data or last):
            return None
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
        if table is not None:
            read = table_reader(str(self._path), table.header, self._columns, self._sensor, self._finger)
            self.held = 0 if self.rows or last or len(table.lines) >= FEW else len(table.lines)
            if self.held:
                self._rest = whole + end + self._rest
                return None
        self._lines += whole.count(b"\n") + 1
        if table is None:
            return None
        self.rows += len(table.lines)
        try:
            return read(table)
        except BadRows:
            self.bad += len(table.lines)
            if self.bad > max(FEW, MAX_BAD_SHARE * self.rows):
                raise
            return None

    def _new_bytes(self) -> bytes:
        try:
            found = self._path.stat()
            size = found.st_size
            if size < self._place or not os.path.samestat(found, self._file):
                change = "became shorter" if size < self._place else "was replaced by another file"
                raise TactileError(self._path, change, "a file that grows", "Watch the new file")
            if size == self._place:
                return b""
            with outside.open_file(self._path, "a CSV file that grows") as file:
                file.seek(self._place - len(self._last))
                data = file.read(len(self._last) + MOST)
        except OSError as error:
            raise TactileError(self._path, error.strerror or str(error), "a readable file") from error
        if not data.startswith(self._last):
            raise TactileError(self._path, "was written anew", "a file that grows", "Watch it again")
        new, self._last = data[len(self._last) :], data[-LAST:]
        self._place += len(new)
        return new


POLL = 0.002  # s between two looks at the file
SET_BACK = 1.0  # s by which a stamp lies before the last if the clock was set, not read late (assumed)
LONGEST_WAIT = 10.0  # s without a frame that are played; a longer gap is skipped
REPORT_EVERY = 1.0  # s between two lines of numbers

Rows = Iterator[tuple[Recording | None, float]]  # new rows and when they came; None now and then without any
Output = Callable[[Shown, dict[str, np.ndarray]], bool]  # takes a frame and its pictures; false: it has ended
Say = Callable[[str], None]


def watch(source: Rows, view: View, camera: DigitCamera | None, outputs: Sequence[Output], say: Say, tell: Say) -> None:
    """Show a view's frames until `source` (of `followed` or `played`) or an output ends. camera : a real DIGIT's, or
    None
    outputs : called with each frame and its picture and camera (H, W, 3); say, tell : with progress, with a summary"""
    reported, failed, lost, silent = time.perf_counter(), False, False, False
    try:
        for rows, came in source:
            shown = None if rows is None else view.show(rows, came)
            if view.signals.silent != silent:
                silent = view.signals.silent
                say("the finger does not answer: no contact" if silent else "the finger answers")
            if shown is not None:
                seen = {"picture": shown.picture}
                if camera is not None:
                    seen["camera"] = camera.picture(shown.picture.shape)
                if not all(output(shown, seen) for output in outputs):
                    break
            if camera is not None and camera.lost and not lost:
                lost = True
                say("the camera gives no more pictures; watching goes on without it")
            if time.perf_counter() - reported >= REPORT_EVERY:
                reported = time.perf_counter()
                say(view.describe_latency() + (f"; force {shown.newtons:.2f} N, {shown.words}" if shown else ""))
    except TactileError:
        failed = not view.frames
        raise
    finally:
        if not failed:
            say(f"rest: {view.signals.found or 'not found'}")
            say(f"counts that {view.signals.polarity.removesuffix('s')}: {view.signals.evidence}")
            tell(f"{view.frames} frames: {view.describe_latency()}")


def followed(
    path: str, idle: float | None, say: Say, columns: ColumnMap | None = None, sensor: str = SOURCE,
    *, wait: bool = True,
) -> Rows:  # fmt: skip
    """Yield new rows of a growing file and their arrival time, s of time.perf_counter; None and the time if none came.
    idle : s without a row after which it ends, None for never; say : called with a line on bad rows
    columns : map of the columns; sensor : name of the sensor; wait : true if the first rows wait for 30 of them
    Raises TactileError as `Growing.poll` does."""
    growing, bad, held = Growing(path, columns, sensor), 0, 0
    last = began = time.perf_counter()  # when a row came; when the first did that is held
    while idle is None or time.perf_counter() - last < idle:
        came = time.perf_counter()
        rows = growing.poll(last=not wait or came - began > PATIENCE)
        if growing.bad > bad:
            bad = growing.bad
            say(f"{bad} of {growing.rows} rows were bad and are passed over")
        if not growing.held:
            began = came
        if rows is None and growing.held == held:
            time.sleep(POLL)
        else:
            last = came
        held = growing.held
        yield rows, came
    if (rows := growing.poll(last=True)) is not None:
        yield rows, time.perf_counter()


def played(path: str, speed: float, say: Say, columns: ColumnMap | None = None, sensor: str = SOURCE) -> Rows:
    """Yield the rows of a finished recording at their times, one part in memory at a time.
    speed : times as fast as recorded, 0 without waiting; say : called with warnings; others : see `followed`"""
    began, last = time.perf_counter(), 0.0
    for part in read_parts(path, columns, sensor):
        recording, done = part.recording, part.repeated
        if np.isnan(recording.time).all():
            found, advice = "snapshots, which do not follow each other", "Translate them: convert --frames-apart"
            raise TactileError(path, found, "frames in order", advice)
        steps = np.diff(recording.time, prepend=recording.time[:1])
        set_back = np.cumsum(np.where(steps < -SET_BACK, 1 / recording.rate - steps, 0.0))  # such a clock goes on here
        due_at = np.sort(recording.time + set_back)  # stamps that were read late: the rows come evenly all the same
        due_at += last - due_at[max(done - 1, 0)]
        last = due_at[-1]
        for warning in recording.warnings if not done else ():
            say(f"warning: {warning}")
        while done < len(recording):
            ahead = due_at[done] / speed - (time.perf_counter() - began) if speed else 0.0
            if ahead > LONGEST_WAIT:
                say(f"nothing for {ahead:.0f} s before frame {done}: skipped")
                began -= ahead
            passed = speed * (time.perf_counter() - began)
            due = done + 1 if speed == 0 else int(due_at.searchsorted(passed, side="right"))
            if due <= done:
                time.sleep(POLL)
                continue
            pdc = None if recording.pdc is None else recording.pdc[done:due]
            rows = dataclasses.replace(recording, electrodes=recording.electrodes[done:due], pdc=pdc)
            yield rows, time.perf_counter()
            done = due
