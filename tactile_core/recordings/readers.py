"""Registry of file layouts, and ``read(path)``, which reads all. `columns` is a map for unknown layouts, or None."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from types import ModuleType

from ..errors import TactileError, path_text
from ..files.installed import modules_of
from ..files.short_text import shown
from ..sensors import SOURCE, electrode_count, title
from . import formats
from .array_store import Store
from .assemble import check_electrodes
from .bags.bag import open_bag
from .bags.bag_recordings import names_of, read_bag, streams_of
from .formats import MAP_ADVICE
from .opened_file import opened, refuse_finger
from .recording import Chosen, Recording, named, split
from .tables.array_table import labels_in
from .tables.cells import NUMBERED
from .tables.column_map import ColumnMap, refuse_bag
from .tables.column_map import read as read_map
from .tables.json_table import read_json
from .tables.map_guess import is_time
from .tables.mapped import open_store, read_by_map, read_mapped
from .tables.table import Table, read_header, read_table

RECOGNISED = 0.5  # share of a layout's own columns that a file must hold; the missing ones are then named (assumed)
PAC = re.compile(r"pac\d+")


@cache
def layouts() -> tuple[ModuleType, ...]:
    """Return the modules of ``formats/``, in the order of their names."""
    return tuple(modules_of(formats.__name__).values())


def read(
    path: str | os.PathLike[str],
    columns: ColumnMap | str | os.PathLike[str] | None = None,
    sensor: str = SOURCE,
    lean: bool = False,
) -> Recording:
    """Read a recording: CSV, HDF5, NPZ, NPY, MATLAB 5, JSON or a ROS bag, detected from the content, not from the name.

    path : the file; ``hand.mat#1`` reads finger 1 of a file of several fingers, ``hands.bag#left/biotac/finger1`` that
        of one topic of a bag
    columns : map that says which column or array is what, for files of no known layout: its file, or what
        ``column_map.read`` returns
    sensor : name of the expected sensor, ``"biotac"``, or another with a descriptor, as ``"biotac_sp"``
    lean : true reads a long CSV file in a third of the memory: without PAC and columns outside the map, which no
        translation needs, and with electrodes in single precision if that is exact, as it is for counts
    Returns a :class:`Recording`: ``time`` (T,) s, ``electrodes`` (T, 19 or 24) counts, ``pdc``, ``pac``, ``tac`` and
    ``tdc`` if the file has them, ``warnings`` of what is odd in it, ``not_taken``: what else the file holds.
    Nothing is resampled, repaired or dropped.
    Raises TactileError for a file that is missing, not a recording, of another sensor, or mostly unreadable.

    >>> recording = tactile.read("touch.csv")
    >>> len(recording), recording.rate, recording.electrodes.shape
    """
    path = path_text(path, "read, path", advice="numpy.savez writes arrays to one")
    columns = read_map(columns) if isinstance(columns, str | os.PathLike) else columns
    if not isinstance(columns, ColumnMap | None):
        raise TactileError("read, columns", f"a {type(columns).__name__}", "the name of a map's file", MAP_ADVICE)
    found = _read(path, columns, sensor, lean)
    if found.sensor != sensor:
        check_electrodes(path, found.electrodes.shape[1], f"a {title(found.sensor)}'s recording", sensor)
    return found


def _read(path: str, columns: ColumnMap | None, sensor: str, lean: bool) -> Recording:
    """Return a file's recording, of any sensor; but a CSV file of another sensor than the expected one is refused by
    its header. lean : true leaves out of a long CSV file what no translation needs"""
    with opened(path) as (container, where, finger, file):
        if columns is not None:
            refuse_bag(path, container)
            refuse_finger(where, finger)
            return read_by_map(where, container, file, columns, partial(_unneeded, columns) if lean else None)
        if container in ("hdf5", "npz", "mat"):
            with open_store(where, container, file) as store:
                layout = layout_of(where, container, names(store) if container == "hdf5" else store.shapes)
                found = _read_finger(layout, store, finger) if container == "mat" else layout.read(store)
                return _noted(found, store)
        if container == "bag":
            with open_bag(where, file) as bag:
                return next(read_bag(bag, split(path)))[0]
        if container == "json":
            layout_of(where, container, read_json(where, file).header)  # which none is
        header = read_header(where, file)
        reader = table_reader(where, header, None, sensor, finger)
        table = read_table(where, file, partial(_unneeded, None) if lean else None)
        found = reader(table)
        taken = table.taken | table.left_out
        return replace(found, not_taken=tuple(name for name in header if name not in taken))


def _noted(recording: Recording, store: Store) -> Recording:
    """Return the recording with the names of the arrays that were not read and, unless it is simulated, the file's
    labels, and a warning of an unread array that may be the time."""
    labels = {} if recording.simulated else labels_in(store, len(recording))
    left, warnings = tuple(name for name in store.shapes if name not in store.taken), recording.warnings
    clock = next((name for name in left if is_time(name) and store.shapes[name][0][:1] == (len(recording),)), None)
    if clock and not recording.simulated and not any(is_time(name) for name in store.taken):
        warnings = (*warnings, f"array {clock!r} is not taken for time. {MAP_ADVICE}")
    return replace(recording, labels=labels, not_taken=left, warnings=warnings)


def _unneeded(columns: ColumnMap | None, name: str) -> bool:
    """Return true if no translation needs the column called `name`: PAC, or, with a map, all columns outside it."""
    if columns is None:
        return PAC.fullmatch(name) is not None
    return name not in columns.names() and not columns.is_nanoseconds(name)


def pac_columns(path: str | os.PathLike[str], columns: ColumnMap | None = None) -> int:
    """Return the number of PAC columns in a CSV file, which lean reading leaves out; 0 for others, and with a map."""
    with opened(os.fspath(path)) as (container, where, _, file):
        if columns is not None or container != "csv":
            return 0
        return sum(PAC.fullmatch(name) is not None for name in read_header(where, file))


def sensor_of(path: str | os.PathLike[str], columns: ColumnMap | None = None) -> str:
    """Return the name of a recording's sensor, by a CSV file's columns or a bag's messages; "biotac" for other files
    and with a map. Raises TactileError for a file that is no recording."""
    path = os.fspath(path)
    with opened(path) as (container, where, _, file):
        if container == "bag":
            with open_bag(where, file) as bag:
                return streams_of(bag, split(path))[0].sensor or SOURCE
        if columns is not None or container != "csv":
            return SOURCE
        return _sensor(layout_of(where, "csv", read_header(where, file)))


def sensor_of_first(paths: Iterable[str | os.PathLike[str]], columns: ColumnMap | None = None) -> str:
    """Return the name of the sensor of the first readable file; "biotac" if no file is, which `read` then refuses."""
    for path in paths:
        with suppress(TactileError):
            return sensor_of(path, columns)
    return SOURCE


def _sensor(layout: ModuleType) -> str:
    return getattr(layout, "SENSOR", SOURCE)


def _read_finger(layout: ModuleType, store: Store | Table, finger: int | None) -> Recording:
    """Return the recording of the requested finger, or of the first, with a warning that names the others."""
    known = layout.fingers(store.header if isinstance(store, Table) else store.shapes)
    chosen = known[0] if finger is None else finger
    if chosen not in known:
        listed = ", ".join(map(str, known))
        raise TactileError(store.path, f"finger {chosen}", f"one that it holds: {listed}", "Name it as path#finger")
    found = layout.read(store, chosen)
    if finger is not None or len(known) == 1:
        return named(found, Chosen(store.path, finger))
    others = ", ".join(map(str, known[1:]))
    warning = f"finger {chosen} is read; others: {others} (ask for one as {os.path.basename(store.path)}#{known[-1]})"
    return replace(found, warnings=(warning, *found.warnings))


def each_finger(path: str | os.PathLike[str], columns: ColumnMap | None = None) -> list[str]:
    """Return a path for each recording that a file holds: the path itself for one, ``path#0``, ``path#1`` for fingers
    of a hand, ``path#topic/finger0`` for a bag of several topics. A map picks one finger. Raises TactileError for other
    files."""
    path = os.fspath(path)
    with opened(path) as (container, where, finger, file):
        if container == "bag":
            with open_bag(where, file) as bag:
                return names_of(bag, path, split(path))
        if finger is not None or columns is not None:
            return [path]
        known: tuple[int, ...] = ()
        if container == "csv":
            header = read_header(path, file)
            hands = [each for each in layouts() if _holds_hands(each) and each.score(header) >= RECOGNISED]
            known = hands[0].fingers(header) if hands else ()
        if container == "mat":
            with open_store(path, container, file) as store:
                known = layout_of(path, container, store.shapes).fingers(store.shapes)
    alone = len(known) < 2 and (container != "mat" or known == (0,))
    return [path] if alone else [f"{path}#{finger}" for finger in known]


def list_fingers(paths: Iterable[str | os.PathLike[str]], columns: ColumnMap | None = None) -> list[str]:
    """Return a path for each recording in the files, by `each_finger`; an unreadable file's own path."""
    found = []
    for path in paths:
        try:
            found += each_finger(path, columns)
        except TactileError:
            found.append(os.fspath(path))
    return found


def _holds_hands(layout: ModuleType) -> bool:
    """Return true for a layout of tables that may hold several fingers."""
    return layout.CONTAINER == "csv" and hasattr(layout, "fingers")


def names(store: Store) -> set[str]:
    """Return the names by which an HDF5 file's layout is detected: its arrays' names, and ``format=...``."""
    return {*store.shapes, f"format={store.attributes.get('format', '')}"}


def table_reader(
    path: str, header: Collection[str], columns: ColumnMap | None, sensor: str = SOURCE, finger: int | None = None
) -> Callable[[Table], Recording]:
    """Return the function that makes the recording of a CSV file's table, by the map or by the header's layout.
    finger : number of the finger to read, None for the first. Raises TactileError for another sensor's file."""
    if columns is not None:
        reader = partial(read_mapped, columns=columns)
    else:
        layout = layout_of(path, "csv", header)
        check_electrodes(path, electrode_count(_sensor(layout)), "line 1", sensor)
        if _holds_hands(layout):
            return partial(_read_finger, layout, finger=finger)
        reader = layout.read
    refuse_finger(path, finger)
    return reader


def layout_of(path: str, container: str, keys: Collection[str]) -> ModuleType:
    """Return the module of the layout that fits a file best, by the share of the layout's own names among the file's.
    Raises TactileError if that share is below `RECOGNISED`.
    container : "csv", "json", "hdf5", "npz" or "mat"; keys : names of the file's columns or arrays"""
    scored = [(layout.score(keys), layout) for layout in layouts() if container == layout.CONTAINER]
    best, layout = max(scored, key=lambda pair: pair[0], default=(0.0, formats))
    if best < RECOGNISED:
        if own := next((key for key in keys if key.startswith("format=tactile-")), ""):
            advice = (
                "`tactile render` and `tactile convert --reverse` take what `tactile convert` wrote, h5py its numbers"
            )
            raise TactileError(path, f"a result of this toolkit, {own}", "a recording", advice)
        held = ", ".join(list(keys)[:6] if container == "csv" else sorted(keys)[:6])
        word = {"csv": "columns", "json": "fields"}.get(container, "arrays")
        known = " | ".join(layout.NAME for _, layout in scored) or "the names that a map gives them"
        if NUMBERED.format(1) in keys:
            path, known = f"{path}, line 1", "a header line"
            raise TactileError(path, "numbers where the column names should be", known, MAP_ADVICE)
        raise TactileError(path, f"no known recording: {word} {shown(held)}", known, MAP_ADVICE)
    return layout
