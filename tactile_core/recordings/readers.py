"""The registry of file layouts, and the one way in: ``read(path)``."""

from __future__ import annotations

import importlib
import os
import pkgutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from functools import cache
from types import ModuleType

from ..errors import TactileError
from . import formats
from .recording import Recording
from .store import open_hdf5, open_npz
from .table import read_header, read_table, shown

RECOGNISED = 0.5  # share of a layout's own columns that a file must hold; the missing ones are then named (assumed)
ZIP_STARTS = (b"PK\x03\x04", b"PK\x05\x06")


@cache
def layouts() -> tuple[ModuleType, ...]:
    """All modules of ``formats/``, in the order of their names."""
    names = sorted(info.name for info in pkgutil.iter_modules(formats.__path__))
    return tuple(importlib.import_module(f"{formats.__name__}.{name}") for name in names)


def read(path: str | os.PathLike[str]) -> Recording:
    """Read a recording of any known layout; which one is told from the content, not from the file's name.

    Raises TactileError for a file that is not there, not a recording, of another sensor, or mostly unreadable.
    """
    path = os.fspath(path)
    with reading(path):
        container = _container(path)
        if container == "hdf5":
            with open_hdf5(path) as store:
                keys = {*store.shapes, f"format={store.attributes.get('format', '')}"}
                return _layout(path, container, keys).read(store)
        if container == "npz":
            with open_npz(path) as store:
                return _layout(path, container, store.shapes).read(store)
        layout = _layout(path, container, read_header(path))
        return layout.read(read_table(path))


@contextmanager
def reading(path: str) -> Iterator[None]:
    """Turn what the system refuses into a TactileError."""
    try:
        yield
    except OSError as error:
        raise TactileError(
            path, error.strerror or str(error), "a readable file", "Check the path and its permissions"
        ) from error
    except MemoryError as error:
        raise TactileError(path, "too large for this machine's memory", advice="Split the recording") from error


def _container(path: str) -> str:
    if os.path.isdir(path):
        raise TactileError(path, "a folder", "one recording file", "Name the recording inside the folder")
    if not os.path.exists(path):
        raise TactileError(path, "there is no such file", "a recording (CSV, HDF5 or NPZ)", "Check the path")
    if not os.path.isfile(path):
        raise TactileError(path, "not a regular file", "a recording (CSV, HDF5 or NPZ)")
    with open(path, "rb") as file:
        start = file.read(8)
    if start == b"\x89HDF\r\n\x1a\n":
        return "hdf5"
    return "npz" if start.startswith(ZIP_STARTS) else "csv"


def _layout(path: str, container: str, keys: Collection[str]) -> ModuleType:
    """The layout that knows most of the file's columns or arrays."""
    scored = [(layout.score(keys), layout) for layout in layouts() if container == layout.CONTAINER]
    best, layout = max(scored, key=lambda pair: pair[0])
    if best < RECOGNISED:
        held = ", ".join(list(keys)[:6] if container == "csv" else sorted(keys)[:6])
        word = "columns" if container == "csv" else "arrays"
        known = " | ".join(layout.NAME for _, layout in scored)
        raise TactileError(
            path,
            f"no known recording: {word} {shown(held)}",
            known,
            "Compare the names with the layouts in the documentation",
        )
    return layout
