"""Force measured beside a recording: a text file of its own, or columns of the recording's file; newtons."""

from __future__ import annotations

import os
import re

import numpy as np

from ..errors import TactileError
from .opened_file import opened
from .recording import Recording, split
from .tables.array_table import table_of
from .tables.json_table import read_json
from .tables.mapped import open_store
from .tables.table import Table, read_table
from .time_stamps import SECONDS, WORDS, seconds_of

MOST_FORCE = 100.0  # N: a fingertip breaks; numbers beyond are grams, millinewtons or counts (assumed)
LEAST_CHANGE = 1e-3  # N, standard deviation below which a column is no force on a finger that touches (assumed)
SHARED = 0.5  # of the recording's frames, that the force's clock must cover (assumed)
OTHER_CLOCK = 300.0  # times the recording's length, that a force's clock in seconds hardly spans (assumed)
COLUMNS = "N in one column or three (x, y, z), behind the column of time if there is one"
OTHER_UNIT = re.compile(r"[\[(](lbf?|lbs|kgf?|gf?|grams?|ozf?|mn|kn|m?v|counts?)[\])]|_(lbf?|lbs|kgf?|gf|ozf)$")
ADVICE = "Leave in it what is measured beside the recording, in newtons"


def read_force(named: str, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return rising times (n,) s from the recording's first frame, and the magnitude (n,) N of the force measured then.

    named : path of a file with the force, or names of columns in the recording's own file, as ``"fx,fy,fz"``
    A file without a column of time needs as many rows as the recording has frames. With one, unix time aligns the two
    if both have it; else both begin at the same moment.
    Raises TactileError if there is no such file or column, for another number of rows, for times that cover less than
    half of the recording, and for values that cannot be newtons."""
    own = not os.path.exists(named)
    path, where = (split(recording.path).file, f"{recording.path}, {named}") if own else (named, named)
    names = [name.strip().lower() for name in named.split(",")] if own else None
    table = _table(path, names)
    picked = [[column for column in table.header if name in (column, column.partition("[")[0])] for name in names or ()]
    if not all(picked):
        found, advice = f"{named!r:.80}, neither a file nor columns of {path}", "Check the path, or their names"
        raise TactileError("--force", found, "the force of a recording", advice)
    chosen = [column for each in picked for column in each] if own else list(table.header)
    columns = table.columns(chosen)
    timed = not own and columns.shape[1] in (2, 4)
    for name in chosen[int(timed) :]:
        if ("time" in name or "stamp" in name) and not own:
            raise TactileError(where, f"the time in column {name!r}", COLUMNS, ADVICE)
        if OTHER_UNIT.search(name):
            raise TactileError(where, f"a column {name!r}", "newtons", "Convert it, and name the column after them")
    size = _size(where, columns[:, int(timed) :], table.lines)
    if timed:
        return _beside(where, columns[:, 0], recording), size
    if len(size) != len(recording) or np.isnan(recording.time).all():
        expected = f"{len(recording):,}, as many as frames in {recording.path}, or a column of time"
        raise TactileError(where, f"{len(size):,} rows", expected, ADVICE)
    return recording.time, size


def read_columns(path: str, names: list[str]) -> np.ndarray:
    """Return the columns (n, c) called `names`, in any case, of a recording's file. Raises TactileError for none."""
    table = _table(path, [name.lower() for name in names])
    missing = [name for name in names if name.lower() not in table.header]
    if missing:
        raise TactileError(path, f"no column {missing[0]!r}", ", ".join(table.header[:30]))
    return table.columns([name.lower() for name in names])


def _table(path: str, names: list[str] | None) -> Table:
    """Return a table of numbers: all of a text file, of another the arrays `names`. Raises TactileError for bags."""
    with opened(path) as (container, where, _, file):
        if container in ("csv", "json"):
            return read_json(where, file) if container == "json" else read_table(where, file)
        if names is None or container == "bag":
            raise TactileError(path, f"a file of kind {container}", "a text table of the force", ADVICE)
        with open_store(where, container, file) as store:
            held = {name.lower() for name in store.shapes}
            return table_of(store, [name for name in names if name in held])


def _size(where: str, columns: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Return the magnitude (n,) N of a force, given as columns (n, 1) or (n, 3) N. Raises TactileError for what cannot
    be a finger's force. lines : (n,) int, the rows' lines in the file `where`, for messages"""
    if columns.shape[1] not in (1, 3):
        raise TactileError(where, f"{columns.shape[1]} columns", COLUMNS, ADVICE)
    size = np.linalg.norm(columns, axis=1)
    if not np.isfinite(size).all():
        found = f"no number in row {lines[int(np.argmin(np.isfinite(size)))]}"
        raise TactileError(where, found, "a force in every row", "Cut the rows off, or fill them in")
    if size.max() > MOST_FORCE or size.std() < LEAST_CHANGE:
        found = f"{size.min():g} to {size.max():g}, which cannot be a finger's force in newtons"
        raise TactileError(where, found, f"changing sizes up to {MOST_FORCE:g} N", "Convert it to newtons")
    return size


def _beside(where: str, stamps: np.ndarray, recording: Recording) -> np.ndarray:
    """Convert stamps (n,) of the force's clock, s to ns, to times (n,) s from the recording's first frame. Raises
    TactileError if they do not rise, or cover less than half of the recording."""
    time, start, _ = seconds_of(stamps)
    if not np.isfinite(stamps).all() or not (np.diff(time) > 0).all():
        raise TactileError(f"{where}, column 1", "numbers that do not rise", "the time", ADVICE)
    if start and recording.start_time:
        time = time + (start - recording.start_time)
    elif time[-1] > OTHER_CLOCK * (lasts := max(recording.duration, 1e-3)):
        unit = min(WORDS, key=lambda unit: abs(np.log(time[-1] * SECONDS[unit] / lasts)))
        found = f"{time[-1]:,.0f} s if it is in seconds, beside a recording of {lasts:.4g} s"
        advice = f"Is it in {WORDS[unit]}? Divide by {1 / SECONDS[unit]:,.0f}"
        raise TactileError(f"{where}, column 1", found, "the time in seconds", advice)
    covered = ((recording.time >= time[0]) & (recording.time <= time[-1])).mean()
    if covered < SHARED:
        found = f"{time[0]:.1f} to {time[-1]:.1f} s of the recording, {covered:.0%} of its frames"
        raise TactileError(where, found, f"at least {SHARED:.0%} of them", "Give the force that was measured meanwhile")
    return time
