"""Paths of the tables and networks that ship with the package."""

from __future__ import annotations

from pathlib import Path

# By this file and not by the package's name: inside Blender the package has another.
_DATA = Path(__file__).parents[1] / "data"


def shipped(name: str) -> Path:
    """Return the path of a file or folder that ships with the package, named relative to ``data/``."""
    return _DATA / name
