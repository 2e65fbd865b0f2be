"""Unpack a gzipped text into a temporary file, up to the size that a text may have."""

from __future__ import annotations

import gzip
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO

from ...errors import TactileError
from .table import MAX_BYTES

START, STEP = b"\x1f\x8b", 2**20


@contextmanager
def unpacked(path: str, file: BinaryIO) -> Iterator[BinaryIO]:
    """Yield the file from its start, unpacked where it is gzipped.

    Raises TactileError for damage, and for what unpacks to more than a text may have.
    """
    packed = file.read(len(START)) == START
    file.seek(0)
    if not packed:
        yield file
        return
    with tempfile.TemporaryFile() as whole:
        try:
            with gzip.GzipFile(fileobj=file) as stream:
                while data := stream.read(STEP):
                    if whole.tell() + len(data) > MAX_BYTES:
                        found = f"unpacks to more than {MAX_BYTES // 2**20} MB"
                        raise TactileError(path, found, "a recording of some hours", "Split the recording")
                    whole.write(data)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise TactileError(path, f"damaged gzip ({error})", "a whole file", "Copy it again") from error
        whole.seek(0)
        yield whole
