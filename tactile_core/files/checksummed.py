"""HDF5 files with their own checksum: the first 512 bytes hold the hash of what follows, and the number of rows. HDF5
lets a file begin with a block for other uses (its "user block"), which every HDF5 reader skips. Arrays, or whole files,
are packed into one such file: a shard of what a job joins at its end."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TactileError
from . import atomic, outside
from .hdf5_checked import declared, open_checked
from .outside import damage_reported

ROOM = 512  # bytes, the smallest user block of HDF5
MAGIC = b"tactile-sealed-1 sha256 "
_DIGITS = 64


def write_checksum(path: Path, rows: int | None = None) -> None:
    """Write the SHA-256 of a closed file and, if given, its number of rows into its user block."""
    line = _line(_digest(path, rows), rows)
    with open(path, "rb+") as file:
        file.write(line)


def verified_checksum(path: Path) -> str | None:
    """Return the SHA-256 that a file states if its content still has it; None if it is missing, cut or changed."""
    try:
        digest, rows = stated(path)
        return digest if digest is not None and _digest(path, rows) == digest else None
    except (OSError, TactileError):
        return None


def stated(path: Path) -> tuple[str | None, int | None]:
    """Return the SHA-256 and the number of rows that a file states, None if it states none; nothing is checked."""
    try:
        with outside.open_file(path) as file:
            room = file.read(ROOM)
    except (OSError, TactileError):
        return None, None
    digest, _, rows = room.partition(b"\n")[0].removeprefix(MAGIC).decode("ascii", "replace").partition(" ")
    count = int(rows) if rows.isascii() and rows.isdigit() and len(rows) < _DIGITS else None
    return (digest, count) if len(digest) == _DIGITS and room == _line(digest, count) else (None, None)


def _line(digest: str, rows: int | None) -> bytes:
    text = digest if rows is None else f"{digest} {rows}"
    return (MAGIC + text.encode(errors="replace") + b"\n").ljust(ROOM, b"\0")


def _digest(path: Path, rows: int | None) -> str:
    with outside.open_file(path) as file:
        file.seek(ROOM)
        found = hashlib.file_digest(file, "sha256")
    if rows is not None:
        found.update(str(rows).encode())
    return found.hexdigest()


def write(file: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays, name -> array, to a checksummed HDF5 file; the same arrays give the same bytes."""
    import h5py

    memory = io.BytesIO()
    with h5py.File(memory, "w", userblock_size=ROOM) as out:
        for name, values in sorted(arrays.items()):
            out.create_dataset(name, data=values, track_times=False)
    with atomic.new_file(file, shared=True) as partial:
        partial.write_bytes(memory.getbuffer())
        write_checksum(partial)


def read(file: Path, rows: Any = (), names: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
    """Return the arrays in a file, name -> array: all, or those in `names`; rows : index that selects their rows
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
    """Unpack the files of a pack into a folder that has none of their names. Raises TactileError for damage."""
    for name, content in read(file).items():
        path = folder / name
        if not path.resolve().is_relative_to(folder.resolve()):
            raise TactileError(file, f"the name {name!r:.80}", "a name inside the folder")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.tobytes())
