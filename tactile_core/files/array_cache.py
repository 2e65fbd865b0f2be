"""Arrays kept between runs in a folder of the cache, each with its hash, which is checked when it is read."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..errors import TactileError
from . import atomic, outside

CHOSEN = "TACTILE_CACHE"  # variable that names the folder
HASHES = "sha256.json"  # in each folder of arrays, with the hash of each; written last: else an entry is not whole
_MOST = 2**16  # bytes of that file; a few names and hashes


def cache_folder() -> Path:
    """Return ``$TACTILE_CACHE``, else ``~/.cache/tactile`` (``%LOCALAPPDATA%`` on Windows); it need not exist."""
    chosen = os.environ.get(CHOSEN)
    if chosen:
        return Path(chosen)
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "tactile"


def entries() -> list[Path]:
    """Return the cache's folders of arrays; the arrays of a deleted one are computed again when needed."""
    return sorted(file.parent for file in cache_folder().glob(f"*/{HASHES}"))


class DamagedError(Exception):
    """Error for a file of the cache that is missing or is not what was stored."""


def load(folder: Path, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Return arrays that `store` wrote, name -> read-only memory map. Raises DamagedError unless their hashes match."""
    try:
        stated = json.loads(outside.read(folder / HASHES, _MOST))
        return {name: _checked(folder / f"{name}.npy", stated[name]) for name in names}
    except (OSError, ValueError, TypeError, KeyError, TactileError) as error:
        raise DamagedError(str(error)) from error


def store(folder: Path, arrays: Iterable[tuple[str, np.ndarray]], room: str) -> dict[str, np.ndarray]:
    """Write named arrays as they come, each whole or not at all, then their hashes; return them, name -> memory map.
    room : space needed, in words, such as "350 MB". Raises TactileError for a folder that cannot be written."""
    with atomic.writing(folder, f"room for {room}", "Make room, or name a folder in TACTILE_CACHE"):
        hashes = {name: _stored(folder / f"{name}.npy", values) for name, values in arrays}
        atomic.write_json(folder / HASHES, hashes)
    return {name: _mapped(folder / f"{name}.npy") for name in hashes}


def claim(folder: Path, room: str) -> None:
    """Make a folder of the cache, before its arrays are computed. room : space needed, in words
    Raises TactileError if it cannot be made or written."""
    with atomic.writing(folder, f"a folder for {room}", "Name one in TACTILE_CACHE"):
        folder.mkdir(parents=True, exist_ok=True)
        atomic.probe(folder)


def _stored(file: Path, values: np.ndarray) -> str:
    """Write values, an array of any shape, to a file; return the SHA-256 of the file's bytes."""
    with atomic.new_file(file) as partial:
        with open(partial, "wb") as out:
            np.save(out, values)
        with open(partial, "rb") as written:
            return hashlib.file_digest(written, "sha256").hexdigest()


def _checked(file: Path, stated: str) -> np.ndarray:
    """Return the array in a file as a memory map. Raises DamagedError if the file's SHA-256 is not the stated one."""
    with outside.open_file(file) as opened:
        found = hashlib.file_digest(opened, "sha256").hexdigest()
    if found != stated:
        raise DamagedError(f"{file.name} has changed since it was built")
    return _mapped(file)


def _mapped(file: Path) -> np.ndarray:
    # A plain view: numpy's memory map class costs a microsecond at every slice.
    return np.load(file, mmap_mode="r", allow_pickle=False).view(np.ndarray)
