"""Read the recording of a table by a map of its columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...sensors import ELECTRODES, SAMPLE_RATE, SP, electrode_count
from ..assemble import assemble, check_electrodes
from ..recording import Recording
from ..time_stamps import SECONDS
from .column_map import CHANNELS, ColumnMap
from .long_table import refuse_several, widen
from .map_guess import NUMBERED
from .table import Table

TITLES = {"csv": "CSV", "json": "JSON", "hdf5": "HDF5", "npz": "NPZ", "mat": "MATLAB"}


def read_mapped(table: Table, columns: ColumnMap, container: str = "csv") -> Recording:
    """Make the recording of a table by a map; container : of the file that the table was made of.

    Raises TactileError for a column that is missing, and the errors of ``assemble``.
    """
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
        warnings=table.warnings,
        names=electrodes,
        labels=table.labels({time, *electrodes, *named.values()}),
        **channels,
    )


def _electrodes(table: Table, names: list[str]) -> list[str]:
    """Return the names of E1 to E19; a single one is that of an array.

    Raises TactileError where they are 19 of the 24 of a BioTac SP.
    """
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
    """Return the electrodes (T, 19), NaN where there is no column. Raises TactileError for one that is missing."""
    held = [name for name in names if name]
    counts = table.counts(held) if all(map(table.has, held)) else table.columns(held)
    if len(held) == len(names):
        return counts
    found = np.full((len(counts), len(names)), np.nan)
    found[:, [place for place, name in enumerate(names) if name]] = counts
    return found
