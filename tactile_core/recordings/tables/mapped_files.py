"""Recordings of any container but bags, read by a map of their columns; and the map that a file suggests."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import BinaryIO

from ..array_store import Store, open_hdf5, open_npz
from ..recording import Recording
from .array_table import names_of, table_of
from .column_map import ColumnMap, refuse_bag
from .json_table import read_json
from .map_guess import guess, with_unit
from .mapped import read_mapped
from .matlab import open_matlab
from .table import read_header, read_table, read_tables

LOOKED_AT = 2**18  # bytes of a text by which its map is guessed: some hundred frames (assumed enough)


def read_by_map(
    path: str, container: str, file: BinaryIO, columns: ColumnMap, left_out: Callable[[str], bool] | None = None
) -> Recording:
    """Read an open file by a map, without columns `left_out`. Raises TactileError for a missing column or array."""
    if container in ("csv", "json"):
        table = read_json(path, file) if container == "json" else read_table(path, file, left_out)
        found, taken = read_mapped(table, columns, container), table.taken
        held = table.header if container == "json" else read_header(path, file)
    else:
        with open_store(path, container, file) as store:
            found = read_mapped(table_of(store, columns.names()), columns, container)
            held, taken = tuple(store.shapes), store.taken
    return replace(found, not_taken=tuple(name for name in held if name not in taken))


@contextmanager
def open_store(path: str, container: str, file: BinaryIO) -> Iterator[Store]:
    """Open the arrays of a file whose container is hdf5, npz or mat."""
    opened = {"hdf5": lambda: open_hdf5(path), "npz": lambda: open_npz(path, file)}
    with opened.get(container, lambda: open_matlab(path, file))() as store:
        yield store


def guess_map(path: str, container: str, file: BinaryIO) -> tuple[list[ColumnMap], tuple[str, ...]]:
    """Guess the maps of an open file's fingers; return its columns, too. Raises TactileError, also for a bag."""
    refuse_bag(path, container)
    if container in ("csv", "json"):
        table = read_json(path, file) if container == "json" else next(read_tables(path, file, LOOKED_AT, 0))[0]
        return guess(table.header, table), table.header
    with open_store(path, container, file) as store:
        names = names_of(store)
        found = guess(names)
        return [with_unit(each, table_of(store, [each.time])) if each.time else each for each in found], tuple(
            store.shapes
        )
