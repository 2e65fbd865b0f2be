"""Pack arrays, or whole files, into one HDF5 file with a checksum: a shard of what a job joins at its end."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TactileError
from . import atomic, checksummed
from .hdf5_checked import declared, open_checked
from .outside import damage_reported


def write(file: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays by name, in the order of their names; the same arrays give the same bytes."""
    import h5py

    memory = io.BytesIO()
    with h5py.File(memory, "w", userblock_size=checksummed.ROOM) as out:
        for name, values in sorted(arrays.items()):
            out.create_dataset(name, data=values, track_times=False)
    with atomic.new_file(file, shared=True) as partial:
        partial.write_bytes(memory.getbuffer())
        checksummed.write_checksum(partial)


def read(file: Path, rows: Any = (), names: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
    """Read arrays by name: all, or those in `names`, and of each all rows, or those that `rows`, an index, selects.
    Raises TactileError for a damaged file."""
    import h5py

    found: dict[str, np.ndarray] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and (not names or name in names):
            declared(item, f"{file}, {name}")
            found[name] = item[rows] if item.shape else item[()]

    with damage_reported(file, "shard", "Run the job again, which makes it again"), open_checked(file) as opened:
        opened.visititems(note)
    return found


def write_files(file: Path, folder: Path) -> None:
    """Pack all files of a folder and below it into the HDF5 file ``file``."""
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    write(file, {path.relative_to(folder).as_posix(): np.frombuffer(path.read_bytes(), np.uint8) for path in paths})


def unpack(file: Path, folder: Path) -> None:
    """Unpack a pack's files into a folder that has none of those names. Raises TactileError for a damaged pack."""
    for name, content in read(file).items():
        path = folder / name
        if not path.resolve().is_relative_to(folder.resolve()):
            raise TactileError(file, f"the name {name!r:.80}", "a name inside the folder")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.tobytes())
