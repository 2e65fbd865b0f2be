"""Folder in which results that take long to compute are kept between runs."""

from __future__ import annotations

import os
import pathlib

HASHES = "sha256.json"  # in each folder of arrays, with the hash of each


def cache_folder() -> pathlib.Path:
    """Return ``$TACTILE_CACHE``, else ``~/.cache/tactile`` (``%LOCALAPPDATA%`` on Windows); it need not exist."""
    chosen = os.environ.get("TACTILE_CACHE")
    if chosen:
        return pathlib.Path(chosen)
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    return (pathlib.Path(base) if base else pathlib.Path.home() / ".cache") / "tactile"


def entries() -> list[pathlib.Path]:
    """List the cache's folders that hold our arrays, which are computed again where they are missing."""
    return sorted(file.parent for file in cache_folder().glob(f"*/{HASHES}"))
