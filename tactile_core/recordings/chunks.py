"""Read a recording in parts that fit into memory; a short one is a single part, equal to the result of `read`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import prod

from ..sensors import SOURCE, title
from .array_store import Store, open_hdf5
from .assemble import check_electrodes
from .bags.bag import open_bag
from .bags.bag_recordings import read_bag
from .opened_file import opened
from .readers import layout_of, names, read, table_reader
from .recording import Recording, split
from .tables.column_map import ColumnMap, refuse_bag
from .tables.table import read_header, read_tables

TEXT_BYTES = 32 * 2**20  # a part's text: about 150,000 frames, 25 minutes at 100 Hz
ARRAY_BYTES = 256 * 2**20  # of a part's arrays, as the file declares them; a simulated one has 150 kB per frame
PART_FRAMES = 100_000  # most frames of a part: 17 minutes at 100 Hz; preparing them takes 15 MB per copy
CONTEXT = 200  # frames that a part shares with the one before: glitches are looked for over 50, smoothing over 101


@dataclass(frozen=True, eq=False)
class Part:
    """Part of a recording. repeated : number of frames at its start that the part before also holds"""

    recording: Recording
    repeated: int


def read_parts(path: str | os.PathLike[str], columns: ColumnMap | None = None, sensor: str = SOURCE) -> Iterator[Part]:
    """Yield the parts of a recording in order; their times count from the whole recording's first frame. CSV and HDF5
    files and bags are read in parts, other files whole.
    columns : map for a file of no known layout, else None; sensor : name of the expected sensor, such as "biotac"
    Raises TactileError for a file that is missing, not a recording, of another sensor, or mostly unreadable."""
    path = os.fspath(path)
    shift, time = 0.0, None
    for part in _parts(path, columns, sensor):
        if part.repeated and time is not None:
            shift = time[-part.repeated]
        if part.recording.sensor != sensor:
            other = title(part.recording.sensor)
            check_electrodes(path, part.recording.electrodes.shape[1], f"a {other}'s recording", sensor)
        time = part.recording.time + shift
        yield replace(part, recording=replace(part.recording, time=time))


def _parts(path: str, columns: ColumnMap | None, sensor: str) -> Iterator[Part]:
    with opened(path) as (container, where, finger, file):
        if columns is not None:
            refuse_bag(path, container)
        long = columns is not None and columns.channel  # its rows are no frames
        if container == "csv" and os.fstat(file.fileno()).st_size > TEXT_BYTES and not long:
            reader = table_reader(where, read_header(where, file), columns, sensor, finger)
            for table, repeated in read_tables(where, file, TEXT_BYTES, CONTEXT):
                yield Part(reader(table), repeated)
        elif container == "hdf5" and columns is None:
            with open_hdf5(path) as store:
                yield from _of_store(store)
        elif container == "bag":
            with open_bag(where, file) as bag:
                for recording, repeated in read_bag(bag, split(path), PART_FRAMES, CONTEXT):
                    yield Part(recording, repeated)
        else:
            yield Part(read(path, columns, sensor), 0)


def _of_store(store: Store) -> Iterator[Part]:
    layout = layout_of(store.path, "hdf5", names(store))
    count = _frames(store, layout.ELECTRODES_NAME)
    frames = max(2 * CONTEXT, min(PART_FRAMES, ARRAY_BYTES // max(1, _bytes_a_frame(store, count))))
    if count <= frames:
        yield Part(layout.read(store), 0)
        return
    for start in range(0, count, frames):
        repeated = min(CONTEXT, start)
        rows = slice(start - repeated, min(start + frames, count))
        yield Part(layout.read(store.rows(rows, count)), repeated)


def _frames(store: Store, name: str) -> int:
    """Return the length of the array `name`; 0 if it is missing or a scalar, which the layout's reader refuses."""
    shape = store.shapes.get(name, ((), None))[0]
    return shape[0] if shape else 0


def _bytes_a_frame(store: Store, count: int) -> int:
    long = [(shape[1:], kind) for shape, kind in store.shapes.values() if count and shape[:1] == (count,)]
    return sum(prod(inner) * max(kind.itemsize, 8) for inner, kind in long)  # read as float64
