"""Long tables, of a row for each value of a channel: made wide, of a row for each frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import TactileError
from .column_map import ColumnMap
from .table import Table

STAMPED = 1.5  # stamps for each value of a channel, up to which rows of one stamp are a frame (assumed)


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
