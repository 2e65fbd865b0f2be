"""HDF5 files with their own checksum: the first 512 bytes hold the hash of all that follows.

HDF5 lets a file begin with a block for other uses (its "user block"), which every HDF5 reader skips.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from ..errors import TactileError
from . import outside

ROOM = 512  # bytes, the smallest user block of HDF5
MAGIC = b"tactile-sealed-1 sha256 "
_DIGITS = 64


def write_checksum(path: Path) -> str:
    """Write the checksum into the user block of a closed file; returns the hash of what follows it."""
    digest = _digest(path)
    with open(path, "rb+") as file:
        file.write(_line(digest))
    return digest


def verified_checksum(path: Path) -> str | None:
    """Return the hash of a file that matches its checksum; None for one that is missing, cut or changed."""
    try:
        digest = stated_checksum(path)
        return digest if digest is not None and _digest(path) == digest else None
    except (OSError, TactileError):
        return None


def stated_checksum(path: Path) -> str | None:
    """Return the hash stored in a file, without checking that its content still matches; None where there is none."""
    try:
        with outside.open_file(path) as file:
            room = file.read(ROOM)
    except (OSError, TactileError):
        return None
    digest = room[len(MAGIC) : len(MAGIC) + _DIGITS].decode("ascii", "replace")
    return digest if room == _line(digest) else None


def _line(digest: str) -> bytes:
    return (MAGIC + digest.encode(errors="replace") + b"\n").ljust(ROOM, b"\0")


def _digest(path: Path) -> str:
    with outside.open_file(path) as file:
        file.seek(ROOM)
        return hashlib.file_digest(file, "sha256").hexdigest()
