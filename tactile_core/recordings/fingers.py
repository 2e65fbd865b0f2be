"""Name the recordings of files that hold several fingers: each is requested as ``path#finger``."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path

from .recording import Recording

FINGERS = 5  # of a hand, at most
FINGER = re.compile(r"(.+)#([0-4])$")


def split(path: str) -> tuple[str, int | None]:
    """Split ``hand.bag#2`` into the path and the finger; a path that exists is taken as it is."""
    found = FINGER.match(path)
    if found is None or os.path.exists(path):
        return path, None
    return found[1], int(found[2])


def name_of(path: str | os.PathLike) -> str:
    """Name a recording and its results: the file's name without extension, with ``_finger2`` for ``hand.bag#2``."""
    file, finger = split(os.fspath(path))
    return Path(file).stem + ("" if finger is None else f"_finger{finger}")


def named(recording: Recording, finger: int | None) -> Recording:
    """Rename a recording by its finger, as in `name_of`; None keeps the file's name."""
    if finger is None:
        return recording
    return dataclasses.replace(recording, name=f"{Path(recording.path).stem}_finger{finger}")
