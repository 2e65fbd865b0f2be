"""Read third-party text files, up to the length that such a file can have."""

from __future__ import annotations

import json
import os
import re

from ..errors import TactileError
from . import outside

MOST = 16 * 2**20  # bytes: a list of 100,000 paths, a scene of 100,000 points (assumed enough)

MOST_DOTS = 100  # in a key; tomllib's time grows with the square of them (Python 3.11 to 3.13)


def read_small(path: str | os.PathLike, most: int = MOST) -> str:
    """Read the UTF-8 text of a file of at most `most` bytes; a byte order mark is skipped.

    Raises OSError and UnicodeDecodeError, TactileError for a longer file, a pipe or a device.
    """
    return outside.read(path, most, "a text file").decode("utf-8-sig")


def toml_quoted(text: str) -> str:
    """Quote text as a TOML basic string: JSON's escapes are valid there, its ASCII keeps names that are no UTF-8."""
    return json.dumps(text.encode(errors="replace").decode())


def read_toml_text(path: str | os.PathLike) -> str:
    """Read a TOML file by `read_small`. Raises TactileError for a key of over a hundred parts, too."""
    text = read_small(path)
    if any(piece.count(".") > MOST_DOTS for piece in re.split(r"[=,#{}\[\]\n]", text)):
        raise TactileError(path, f"a key of over {MOST_DOTS} parts", "short keys")
    return text
