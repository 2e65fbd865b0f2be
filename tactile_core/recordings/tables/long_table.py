"""Long tables, of a row for each value of a channel: made wide, of a row for each frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import TactileError
from .column_map import ColumnMap
from .table import Table

STAMPED = 1.5  # stamps for each value of a channel, up to which rows of one stamp are a frame (assumed)


MOST_SERIES = 5  # values of a column that tells fingers apart; more are places in a buffer (assumed)
LOOKED_AT = 10_000  # rows
TURNS = 0.6  # stamps a row, below which rows share them; those of two fingers have 0.5 (assumed)


def refuse_several(table: Table, columns: ColumnMap) -> None:
    """Raise TactileError for a table of several fingers whose rows take turns: a column tells rows of one stamp apart.

    Frames of one stamp, of a coarse clock or a buffer, have no such column.
    """
    if not columns.time or any(name not in table.header for name in columns.names()):
        return
    keys = [table.header.index(name) for each in (columns.time, columns.channel) if (name := each.lower())]

    def different(places: list[int]) -> int:
        """Count the different values that columns have together in the first rows."""
        rows = np.column_stack([table.exact.get(place, table.values[:, place])[:LOOKED_AT] for place in places])
        return len(np.unique(rows, axis=0))

    every = min(len(table.lines), LOOKED_AT)
    apart = [place for place, name in enumerate(table.header) if place not in keys and name not in columns.names()]
    for place in apart if different(keys) < TURNS * every else ():
        if 1 < different([place]) <= MOST_SERIES and different([*keys, place]) == every:
            name = table.header[place]
            found = f"rows of {different([place])} series take turns, told apart by column {name!r}"
            raise TactileError(table.path, found, "one recording", f"Split the file by {name!r}: a file for each")


def widen(table: Table, columns: ColumnMap) -> Table:
    """Return a table of a column for each mapped channel, and the time's.

    Rows of one stamp are a frame, in the order of time, where stamps differ from frame to frame; else a frame ends
    where the channels begin again, in the order in which the file first has them. What a frame has not is NaN.
    Raises TactileError where the file has none of the channels.
    """
    channels = _texts(table, columns.channel.lower())
    wanted = [name for name in dict.fromkeys(channels.tolist()) if name in columns.channels()]
    if not wanted:
        where, found = f"{table.path}, column {columns.channel!r}", ", ".join(sorted(set(channels.tolist()))[:8])
        raise TactileError(where, f"channels {found}", "those of the map", "Change the map's electrodes")
    places = {name: place for place, name in enumerate(wanted)}
    channel = np.array([places.get(name, -1) for name in channels])
    rows = np.flatnonzero(channel >= 0)
    channel, time = channel[rows], columns.time.lower()
    stamps = table.column(time)[rows] if time else np.zeros(len(rows))
    unique, stamped = np.unique(stamps, return_inverse=True)
    most = np.bincount(channel).max()
    if most <= len(unique) <= STAMPED * most:
        frame = stamped
    else:
        frame = np.cumsum(np.r_[False, channel[1:] <= channel[:-1]])
    first = np.full(int(frame.max()) + 1, len(rows))
    np.minimum.at(first, frame, np.arange(len(rows)))
    values = np.full((len(first), len(wanted)), np.nan)
    values[frame, channel] = table.column(columns.value.lower())[rows]
    header = wanted
    if time:
        header, values = [time, *wanted], np.column_stack([stamps[first], values])
    labels = table.labels({time, columns.channel.lower(), columns.value.lower()})
    texts = {name: column[rows][first] for name, column in labels.items()}
    made = replace(table, header=tuple(header), values=values, lines=table.lines[rows][first], texts=texts)
    return replace(made, problems=(), exact={}, words={})


def _texts(table: Table, name: str) -> np.ndarray:
    """Return the channels (T,) of the rows as texts, in lower case."""
    if name in table.words:
        table.taken.add(name)
        texts = table.words[name].texts(table.values[:, table.header.index(name)])
        return np.array([text.lower() for text in texts], dtype=object)
    numbers = table.column(name)
    return np.array([f"{number:g}" for number in numbers], dtype=object)
