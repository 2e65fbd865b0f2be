"""Text files of strangers, read only as far as such a file can be long."""

from __future__ import annotations

import os
import re

from .errors import TactileError

MOST = 16 * 2**20  # bytes: a list of 100,000 paths, a scene of 100,000 points (assumed enough)

MOST_DOTS = 100  # in a key; tomllib's time grows with the square of them (Python 3.11 to 3.13)


def read_small(path: str | os.PathLike) -> str:
    """UTF-8 text of a file of at most 16 MB. Raises OSError and UnicodeDecodeError, TactileError for a longer one."""
    with open(path, "rb") as file:
        content = file.read(MOST + 1)
    if len(content) > MOST:
        raise TactileError(path, f"more than {MOST // 2**20} MB", "a short text file")
    return content.decode("utf-8")


def read_toml_text(path: str | os.PathLike) -> str:
    """As `read_small`, of a TOML file. Raises TactileError for a key of over a hundred parts, too."""
    text = read_small(path)
    if any(piece.count(".") > MOST_DOTS for piece in re.split(r"[=,#{}\[\]\n]", text)):
        raise TactileError(path, f"a key of over {MOST_DOTS} parts", "short keys")
    return text
