"""Open files from outside: regular files only, up to a size, so that no pipe, socket or device hangs a verb. Every file
of a user or stranger is opened here; `check` goes before a library that opens files by name."""

from __future__ import annotations

import errno
import json
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path
from typing import Any

from ..errors import TactileError

KINDS = {
    stat.S_IFIFO: "a named pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device",
}  # fmt: skip
MOST_TEXT = 16 * 2**20  # bytes: a list of 100,000 paths, a scene of 100,000 points (assumed enough)
MOST_DOTS = 100  # in a TOML key; tomllib's time grows with the square of them (Python 3.11 to 3.13)


def check(path: str | os.PathLike, expected: str = "a regular file") -> os.stat_result:
    """Return a file's status; links are followed. Raises TactileError, with what was `expected`, for a pipe, socket or
    device, and OSError for a missing file or a folder."""
    return _regular(path, os.stat(path), expected)


def open_file(path: str | os.PathLike, expected: str = "a regular file") -> BufferedReader:
    """Open a regular file's bytes, without waiting. Raises TactileError for a pipe, socket or device, and OSError."""
    check(path, expected)  # before opening: some devices act when they are opened
    file = open(path, "rb", opener=_open)  # noqa: SIM115 - the caller closes it
    try:
        _regular(path, os.fstat(file.fileno()), expected)  # it may have been exchanged since
    except BaseException:  # Ctrl-C, too; raised again
        file.close()
        raise
    return file


def read(path: str | os.PathLike, most: int, expected: str = "a regular file") -> bytes:
    """Return a file's bytes, at most ``most``. Raises TactileError for a longer or no regular file, and OSError."""
    with open_file(path, expected) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise TactileError(path, f"more than {_size(most)}", f"{expected} of at most {_size(most)}")
    return content


def read_small(path: str | os.PathLike, most: int = MOST_TEXT) -> str:
    """Return UTF-8 text of at most `most` bytes. Raises OSError, UnicodeDecodeError, and TactileError as `read`."""
    return read(path, most, "a text file").decode("utf-8-sig")


def toml_quoted(text: str) -> str:
    """Return text as a TOML string: JSON's escapes are valid there, and its ASCII keeps names that are no UTF-8."""
    return json.dumps(text.encode(errors="replace").decode())


def toml_value(value: Any, scale: float = 1.0) -> str:
    """Return a text, number (six digits) or list of these as TOML; numbers are multiplied by ``scale``."""
    if isinstance(value, str):
        return toml_quoted(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml_value(each, scale) for each in value)}]"
    return f"{scale * value + 0.0:.6g}"  # no negative zero


def read_toml_text(path: str | os.PathLike) -> str:
    """Return the text of a TOML file, raising as `read_small`; and TactileError for a key of over a hundred parts."""
    text = read_small(path)
    if any(piece.count(".") > MOST_DOTS for piece in re.split(r"[=,#{}\[\]\n]", text)):
        raise TactileError(path, f"a key of over {MOST_DOTS} parts", "short keys")
    return text


def inside(folder: str | os.PathLike, name: str, expected: str = "a regular file") -> Path:
    """Return the path of a file, existing or not, in a stranger's folder. Raises TactileError, with what was
    `expected`, if it leads out of the folder."""
    path = Path(folder) / name
    try:
        within = path.resolve().is_relative_to(Path(folder).resolve())
    except (OSError, RuntimeError, ValueError) as error:  # links in a circle; RuntimeError before Python 3.13
        raise TactileError(path, f"cannot be followed ({error})", expected) from error
    if not within:
        raise TactileError(path, "a link out of its folder", expected, "Put the file itself there")
    return path


def _open(path: str | os.PathLike, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _regular(path: str | os.PathLike, found: os.stat_result, expected: str) -> os.stat_result:
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if not stat.S_ISREG(found.st_mode):
        kind = KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise TactileError(path, f"{kind}, no regular file", expected, "Copy what it gives into a file")
    return found


def _size(count: int) -> str:
    return f"{count // 2**20} MB" if count >= 2**20 else f"{count} bytes"


@contextmanager
def damage_reported(
    where: str | os.PathLike, what: str, advice: str = "Copy or export the recording again"
) -> Iterator[None]:
    """Raise a library's error of the block as TactileError: `where`, a file or a part of one, is "damaged `what`".
    TactileError and MemoryError pass."""
    try:
        yield
    except (TactileError, MemoryError):
        raise
    except Exception as error:  # the file libraries raise a dozen types on damaged bytes
        raise TactileError(where, f"damaged {what} ({_short(error)})", "a whole file", advice) from error


def _short(error: BaseException) -> str:
    text = str(error).strip().splitlines()
    return f"{type(error).__name__}: {text[0][:80]}" if text else type(error).__name__
