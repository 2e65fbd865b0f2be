"""Read recordings by a map of columns, or guess it; in long tables, too, where each row holds one channel."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np

from ...errors import TactileError
from ...sensors import ELECTRODES, SAMPLE_RATE, SP, electrode_count
from ..array_store import Store, open_hdf5, open_matlab, open_npz
from ..assemble import assemble, check_electrodes
from ..recording import Recording
from ..time_stamps import SECONDS
from .array_table import names_of, table_of
from .column_map import CHANNELS, ColumnMap, refuse_bag
from .json_table import read_json
from .map_guess import NUMBERED, guess, with_unit
from .table import Table, read_header, read_table, read_tables

TITLES = {"csv": "CSV", "json": "JSON", "hdf5": "HDF5", "npz": "NPZ", "mat": "MATLAB"}
STAMPED = 1.5  # stamps for each value of a channel, up to which rows of one stamp are a frame (assumed)
MOST_SERIES = 5  # values of a column that tells fingers apart; more are places in a buffer (assumed)
LOOKED_AT = 10_000  # rows
GUESSED_BY = 2**18  # bytes of a text by which its map is guessed: some hundred frames (assumed enough)
MILLIVOLTS = re.compile(r"(?:^|[^a-z])mv(?:[^a-z]|$)")
TURNS = 0.6  # stamps per row, below which rows share them; those of two fingers have 0.5 (assumed)


def refuse_several(table: Table, columns: ColumnMap) -> None:
    """Raise TactileError if fingers' rows alternate: a column outside the map tells rows of one stamp apart."""
    if not columns.time or any(name not in table.header for name in columns.names()):
        return
    keys = [table.header.index(name) for each in (columns.time, columns.channel) if (name := each.lower())]

    def different(places: list[int]) -> int:
        """Return the number of distinct combinations of values in the columns `places`, in the first rows."""
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
    """Convert a long table, with a row for each value of a channel, to one with a column for each mapped channel and
    one for the time.

    Rows of one stamp make a frame, in the order of time, if stamps differ from frame to frame; else a frame ends where
    the channels begin again. Missing values are NaN. Raises TactileError for a file without any of the channels."""
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
    """Return the column `name` as texts (T,) in lower case: the rows' channels."""
    if name in table.words:
        table.taken.add(name)
        texts = table.words[name].texts(table.values[:, table.header.index(name)])
        return np.array([text.lower() for text in texts], dtype=object)
    numbers = table.column(name)
    return np.array([f"{number:g}" for number in numbers], dtype=object)


def read_mapped(table: Table, columns: ColumnMap, container: str = "csv") -> Recording:
    """Return the recording in a table, by a map. container : "csv", "json", "hdf5", "npz" or "mat"
    Raises TactileError for a missing column, for rows of several fingers in turn, and for what `assemble` refuses."""
    refuse_several(table, columns)
    if columns.channel:
        table = widen(table, columns)
    electrodes = _electrodes(table, [name.lower() for name in columns.electrodes])
    time = columns.time.lower()
    named = {name: column for name in CHANNELS if (column := getattr(columns, name).lower())}
    channels: dict[str, Any] = {name: table.column(column) for name, column in named.items()}
    stamps = None
    if time:
        stamps = SECONDS[columns.time_unit] * table.column(time)
        for name in filter(columns.is_nanoseconds, table.header):
            stamps = stamps + 1e-9 * table.column(name)
    if stamps is None and columns.rate != SAMPLE_RATE:
        stamps = np.arange(len(table.lines)) / columns.rate
    return assemble(
        table.path,
        f"{TITLES[container]} with columns mapped by --columns",
        electrodes=_readings(table, electrodes),
        stamps=stamps,
        rows=table.lines,
        problems=table.essential({time, *electrodes}, named.values()),
        row_word="line" if container == "csv" else "frame",
        warnings=(*table.warnings, *_tell_millivolts(electrodes)),
        names=electrodes,
        labels=table.labels({time, *electrodes, *named.values()}),
        **channels,
    )


def _tell_millivolts(names: list[str]) -> list[str]:
    """Return a list of a sentence if electrodes' names say mV, which their counts do not show; else []."""
    told = next(filter(MILLIVOLTS.search, names), None)
    advice = "1.241 with --counts-per-unit if the range is 3.3 V"
    return (
        [f"electrodes are called mV ({told!r}) and taken for counts, without counts a unit: {advice}"] if told else []
    )


def _electrodes(table: Table, names: list[str]) -> list[str]:
    """Return the columns of E1 to E19, by name or of an array. Raises TactileError for 19 of a BioTac SP's 24."""
    known = (*table.header, *table.left_out)
    if len(names) == 1:
        inner = [name for name in known if name.startswith(f"{names[0]}[")]
        if len(inner) != ELECTRODES:
            check_electrodes(table.path, len(inner), names[0])
        return [f"{names[0]}[{place}]" for place in range(ELECTRODES)]
    of_sp = electrode_count(SP)
    stems = [(found[1], found[3]) for found in map(NUMBERED.match, known) if found]
    for name in names:
        found = NUMBERED.match(name)
        if found and stems.count((found[1], found[3])) == of_sp:
            check_electrodes(table.path, of_sp, f"line 1, columns {found[1]}..{found[3]}")
    return names


def _readings(table: Table, names: Sequence[str]) -> np.ndarray:
    """Return electrodes (T, 19) of columns `names`, NaN for "". Raises TactileError for a missing column."""
    held = [name for name in names if name]
    counts = table.counts(held) if all(map(table.has, held)) else table.columns(held)
    if len(held) == len(names):
        return counts
    found = np.full((len(counts), len(names)), np.nan)
    found[:, [place for place, name in enumerate(names) if name]] = counts
    return found


def read_by_map(
    path: str, container: str, file: BinaryIO, columns: ColumnMap, left_out: Callable[[str], bool] | None = None
) -> Recording:
    """Return the recording in an open file, by the map `columns`. container : "csv", "json", "hdf5", "npz" or "mat"
    left_out : function that is true for a column's name if a long text need not keep it; None keeps all
    Raises TactileError for a missing column or array."""
    if container in ("csv", "json"):
        table = read_json(path, file) if container == "json" else read_table(path, file, left_out)
        found, taken = read_mapped(table, columns, container), table.taken
        held = table.header if container == "json" else read_header(path, file)
    else:
        with open_store(path, container, file) as store:
            found = read_mapped(table_of(store, columns.names()), columns, container)
            held, taken = tuple(store.shapes), store.taken
    return replace(found, not_taken=tuple(name for name in held if name not in taken))


def open_store(path: str, container: str, file: BinaryIO) -> AbstractContextManager[Store]:
    """Open the arrays of a file. container : "hdf5", "npz" or "mat"""
    if container == "hdf5":
        return open_hdf5(path)
    return open_npz(path, file) if container == "npz" else open_matlab(path, file)


def guess_map(path: str, container: str, file: BinaryIO) -> tuple[list[ColumnMap], tuple[str, ...]]:
    """Return a guessed map for each finger in an open file, and the columns' names. Raises TactileError for a bag."""
    refuse_bag(path, container)
    if container in ("csv", "json"):
        table = read_json(path, file) if container == "json" else next(read_tables(path, file, GUESSED_BY, 0))[0]
        return guess(table.header, table), table.header
    with open_store(path, container, file) as store:
        found = guess(names_of(store))
        timed = [with_unit(each, table_of(store, [each.time])) if each.time else each for each in found]
        return timed, tuple(store.shapes)
