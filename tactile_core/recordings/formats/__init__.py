"""Layouts of recordings, one file each, found automatically. Each module has four names:

``CONTAINER``  "csv", "hdf5", "npz" or "mat"
``NAME``       the layout in words, for messages
``score(keys) -> float``  share (0..1) of the layout's own columns or arrays among those of the file
``read(source) -> Recording``  source is a ``table.Table`` for CSV, an ``array_store.Store`` for all others; it picks
               its columns and gives them to ``assemble.assemble``, which checks them; the rest is reported as not taken

A MATLAB or BioTac SP layout also has ``fingers(keys) -> tuple[int, ...]``, the fingers in the file, and its function is
``read(source, finger)``. A BioTac SP layout has ``SENSOR``, the sensor's name. An HDF5 layout has ``ELECTRODES_NAME``,
the name of the array whose length is the number of frames.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

import numpy as np

from ...errors import TactileError
from ...sensors import ELECTRODES, SP, electrode_count
from ..array_store import Store
from ..assemble import assemble, check_electrodes
from ..recording import Recording
from ..tables.map_guess import is_time
from ..tables.table import Table

MAP_ADVICE = "Name its columns in a map: tactile info FILE --columns map.toml writes one to fill in"
TURN_ADVICE = "Transpose it, or give a map, which does: tactile info FILE --columns map.toml writes one"


def share(keys: Collection[str], wanted: Collection[str]) -> float:
    """Return the share (0..1) of the wanted names that are among the keys."""
    return sum(name in keys for name in wanted) / len(wanted)


def of_table(table: Table, layout: str, time: str, electrodes: list[str], **channels: list[str]) -> Recording:
    """Return the recording of a table, whose columns pdc, tac and tdc keep these names. layout : its name in words
    time, electrodes : names of columns; channels : field of `Recording` -> names of its columns

    A channel that lean reading left out is None, a missing electrode a dead channel. Raises TactileError for any other
    missing column, and for what `assemble` refuses."""
    _check_numbers(table, electrodes)
    columns: dict[str, Any] = {
        channel: table.columns(names, np.float32)
        for channel, names in channels.items()
        if not table.left_out.issuperset(names)
    }
    used = ["pdc", "tac", "tdc", *(name for names in channels.values() for name in names)]
    return assemble(
        table.path,
        layout,
        electrodes=table.counts(electrodes),
        stamps=table.column(time),
        rows=table.lines,
        problems=table.essential([time, *electrodes], used),
        row_word="line",
        warnings=table.warnings,
        names=[name if table.has(name) else "" for name in electrodes],
        labels=table.labels({time, *electrodes, *used}),
        pdc=table.column("pdc"),
        tac=table.column("tac"),
        tdc=table.column("tdc"),
        **columns,
    )


def _check_numbers(table: Table, electrodes: list[str]) -> None:
    """Raise TactileError if electrodes' columns are numbered otherwise, as ele0 to ele18 or ele01 for ele1 to ele19."""
    stem, missing = electrodes[0].rstrip("01"), [name for name in electrodes if not table.has(name)]
    other = [name for name in table.header if re.fullmatch(rf"{stem}\d+", name) and name not in electrodes]
    if other and missing:
        found, expected = f"column {other[0]!r} and no {missing[0]!r}", f"{electrodes[0]} .. {electrodes[-1]}"
        raise TactileError(f"{table.path}, line 1", found, expected, MAP_ADVICE)


# A hand's fingers in the order of their numbers.
HAND = {"ff": "first finger", "mf": "middle finger", "rf": "ring finger", "lf": "little finger", "th": "thumb"}


def share_of_fingers(keys: Collection[str], style: str) -> float:
    """Return the share (0..1) of a finger's columns that a file has, for the finger of which it has the most.
    keys : names of the file's columns; style : format of their names, by finger and electrode: "{}_e{}" for ff_e1"""
    return max(share(keys, _of_finger(style, number)) for number in range(len(HAND)))


def fingers_of(keys: Collection[str], style: str) -> tuple[int, ...]:
    """Return the numbers of the fingers of which a file has any column.
    keys : names of the file's columns; style : format of their names, by finger and electrode: "{}_e{}" for ff_e1"""
    return tuple(number for number in range(len(HAND)) if share(keys, _of_finger(style, number)))


def of_finger(table: Table, finger: int, *, layout: str, style: str, snapshots: bool) -> Recording:
    """Return the recording of one finger in a table of BioTac SPs; its `about` lists the names of the other columns.
    finger : 0 first, 1 middle, 2 ring, 3 little, 4 thumb; layout : the layout's name in words
    style : format of the columns' names, by finger and electrode: "{}_e{}" for ff_e1
    snapshots : true if frames do not follow each other in time; else a column of time is read, if there is one
    Raises TactileError for what `assemble` refuses."""
    names = _of_finger(style, finger)
    electrodes = {name for number in range(len(HAND)) for name in _of_finger(style, number)}
    table.taken.update(electrodes)
    clocks = [] if snapshots else [name for name in table.header if is_time(name) and name not in table.words]
    timed = [name for name in clocks if np.isfinite(table.column(name)).mean() > 0.5][:1]  # not one of gaps
    used = electrodes | {*timed}
    return assemble(
        table.path,
        layout,
        electrodes=table.columns(names),
        stamps=table.column(timed[0]) if timed else None,
        rows=table.lines,
        problems=table.essential([*timed, *names]),
        row_word="line",
        about={"finger": tuple(HAND)[finger], "labels": [name for name in table.header if name not in used]},
        warnings=table.warnings,
        names=names,
        labels=table.labels(used),
        sensor=SP,
        snapshots=snapshots,
    )


def _of_finger(style: str, finger: int) -> list[str]:
    return [style.format(tuple(HAND)[finger], number) for number in range(1, electrode_count(SP) + 1)]


def electrodes_of(store: Store, name: str) -> np.ndarray:
    """Return the electrodes (T, 19) in the array `name`. Raises TactileError for another shape or sensor."""
    shape, kind = store.shapes[name]
    if len(shape) == 2 and shape[0] == ELECTRODES != shape[1]:
        raise TactileError(f"{store.path}, {name}", f"shape {shape}", f"(frames, {ELECTRODES})", TURN_ADVICE)
    if len(shape) == 2 and shape[1] != ELECTRODES:
        check_electrodes(store.path, shape[1], name)
    exact = kind.kind in "iu" and kind.itemsize <= 2  # in single precision, half the memory of a long recording
    return store.array(name, (None, ELECTRODES), np.float32 if exact else np.float64)
