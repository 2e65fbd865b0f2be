"""HDF5 files with their own checksum: the first 512 bytes hold the hash of what follows, and the number of rows. HDF5
lets a file begin with a block for other uses (its "user block"), which every HDF5 reader skips."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ..errors import TactileError
from . import outside

ROOM = 512  # bytes, the smallest user block of HDF5
MAGIC = b"tactile-sealed-1 sha256 "
_DIGITS = 64


def write_checksum(path: Path, rows: int | None = None) -> str:
    """Write the checksum, and where given the number of rows, into the user block of a closed file; return the hash."""
    digest = _digest(path, rows)
    with open(path, "rb+") as file:
        file.write(_line(digest, rows))
    return digest


def verified_checksum(path: Path) -> str | None:
    """Return the hash of a file that matches its checksum; None for one that is missing, cut or changed."""
    try:
        digest, rows = _stated(path)
        return digest if digest is not None and _digest(path, rows) == digest else None
    except (OSError, TactileError):
        return None


def stated_checksum(path: Path) -> str | None:
    """Return the hash stored in a file, without checking that its content still matches; None where there is none."""
    return _stated(path)[0]


def stated_rows(path: Path) -> int | None:
    """Return the number of rows stored beside the hash, unchecked; None where there is none."""
    return _stated(path)[1]


def _stated(path: Path) -> tuple[str | None, int | None]:
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
