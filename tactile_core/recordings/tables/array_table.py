"""Named arrays of HDF5, NPZ and MATLAB files as a table: column j of an array (T, n) is called ``name[j]``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import product
from math import prod

import numpy as np

from ...errors import TactileError
from ...sensors import ELECTRODES
from ..array_store import Store
from ..assemble import MAX_FRAMES
from ..labels import labels_of
from .cells import LABEL, MAX_COLUMNS
from .table import Table

INDEX = re.compile(r"(.*?)((?:\[\d+\])*)$", re.DOTALL)


def names_of(store: Store) -> dict[str, int]:
    """Return the names of a file's columns of numbers, in lower case, each with its number of rows."""
    found: dict[str, int] = {}
    for name, (shape, kind) in store.shapes.items():
        rows, inner = _rows(shape)
        if rows > 1 and kind.kind in "iufb" and len(found) + prod(inner) <= MAX_COLUMNS:
            found |= dict.fromkeys(_indexed(name, inner), rows)
    return found


def _indexed(name: str, inner: tuple[int, ...]) -> list[str]:
    """Return the names of an array's columns, in lower case; inner : shape of one of its rows"""
    return [name.lower() + "".join(f"[{at}]" for at in index) for index in product(*map(range, inner))]


def _rows(shape: tuple[int, ...]) -> tuple[int, tuple[int, ...]]:
    """Return an array's number of rows and a row's shape; (19, T) and (1, T), as of MATLAB, are transposed."""
    if _is_turned(shape):
        shape = shape[::-1]
    if len(shape) == 2 and shape[1] == 1:
        shape = shape[:1]
    return (shape[0], shape[1:]) if shape else (0, ())


def _is_turned(shape: tuple[int, ...]) -> bool:
    return len(shape) == 2 and shape[1] > shape[0] and shape[1] != ELECTRODES


def table_of(store: Store, wanted: Iterable[str]) -> Table:
    """Return a table of the wanted columns, with the file's labels.
    wanted : names of columns, such as ``name[3]``; an array's name stands for all its columns
    Raises TactileError for a missing array, and for arrays of different lengths."""
    called = {name.lower(): name for name in store.shapes}
    columns: dict[str, np.ndarray] = {}
    held: dict[str, np.ndarray] = {}
    for name in dict.fromkeys(wanted):
        found = INDEX.match(name)
        array = called.get(found[1] if found else name)
        if array is None:
            expected = ", ".join(list(names_of(store))[:8])
            raise TactileError(f"{store.path}, {name}", "this array is missing", expected, "Change the map")
        if array not in held:
            held[array] = _read(store, array)
        values = held[array]
        columns |= zip(_indexed(array, values.shape[1:]), values.reshape(len(values), -1).T, strict=True)
    lengths = {name: len(values) for name, values in held.items()}
    frames = next(iter(lengths.values()), 0)
    for name, length in lengths.items():
        if length != frames:
            expected = f"{frames:,} as of {next(iter(lengths))}"
            raise TactileError(f"{store.path}, {name}", f"{length:,} rows", expected, "Map arrays of one recording")
    labels = labels_in(store, frames)
    values = np.column_stack(list(columns.values())) if columns else np.empty((0, 0))
    return Table(store.path, tuple(columns), values, np.arange(frames), (), texts=labels)


def _read(store: Store, name: str) -> np.ndarray:
    """Return the array `name`, rows first: (T, ...) or, for one column, (T,). Raises TactileError if empty or long."""
    shape = store.shapes[name][0]
    frames = _rows(shape)[0]
    if not (frames and prod(shape)) or frames > MAX_FRAMES:
        expected, advice = f"1 to {MAX_FRAMES:,} rows", "Split a longer recording"
        raise TactileError(f"{store.path}, {name}", f"shape {shape}", expected, advice)
    found = store.array(name, shape)
    found = found.T if _is_turned(shape) else found
    return found[:, 0] if found.ndim == 2 and found.shape[1] == 1 else found


def labels_in(store: Store, frames: int) -> dict[str, np.ndarray]:
    """Return labels, name -> (`frames`,) texts: arrays of texts; numbers and attributes with a label's usual name."""
    found = {
        name: np.full(frames, value, dtype=object)
        for name, value in store.attributes.items()
        if isinstance(value, str | int | float) and LABEL.search(name.lower())
    }
    for name, (shape, kind) in store.shapes.items():
        if _rows(shape)[0] not in (frames, 0, 1) or prod(_rows(shape)[1]) != 1:
            continue
        *groups, last = name.lower().split("/")
        named = LABEL.search(last) or {"label", "labels"} & {*groups}  # not all in a group `trial_1`
        if kind.kind in "iufb" and named:
            texts = [f"{value:.10g}" for value in np.ravel(store.array(name, shape))]
        elif store.is_text(name):
            texts = store.texts(name)
        else:
            continue
        found[name] = np.array(texts * (frames if len(texts) == 1 else 1), dtype=object)
    return labels_of({name: map(str, column) for name, column in found.items()})
