"""Read third-party HDF5 files safely: no other file is read, and no chunk unpacks to more than it declares."""

from __future__ import annotations

import functools
import math
import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ..errors import TactileError
from . import outside
from .hdf5_free_lists import check_free_lists

if TYPE_CHECKING:
    import h5py

MAX_CHUNK = 256 * 2**20  # bytes of an unpacked chunk (assumed enough: HDF5 advises 1 MB, and keeps one in memory)
MAX_RATIO = 1032  # the most that deflate packs (zlib, technical details); lzf at most 88
FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32", 32000: "lzf"}  # that are undone; the numbers are HDF5's
DEFLATE, CHECKSUM, STEP = 1, 3, 2**20
WIDTHS = {2, 4, 8, 16, 32}  # bytes of an address and of a size; the library opens no file with others
MAX_DEPTH = 32  # groups within groups, whose names the library looks up again and again (assumed enough; ours have 2)
MAX_PLAIN_CHUNK = 2**24  # bytes of a chunk in a file of our own; they have 0.2 MB
SIGNATURE = b"\x89HDF\r\n\x1a\n"


@contextmanager
def open_checked(path: str | os.PathLike) -> Iterator[h5py.File]:
    """Open for reading. Raises h5py's errors, and TactileError for a file that could take more memory than it declares.

    Refused: datasets in other files (external links, external or virtual storage), chunks of over 256 MB, filters other
    than gzip, lzf, shuffle and checksums, and chunks that unpack to more than their size. Reading a row then takes at
    most one chunk of memory beyond the row, reading a dataset takes its declared size, which the caller has to limit:
    see ``declared``.
    """
    import h5py

    check_before_opening(path)
    with h5py.File(path, "r") as file:
        beyond = file.id.links.visit(_outside, info=True)
        if beyond is not None:
            if beyond.count(b"/") >= MAX_DEPTH:
                raise _refused(path, beyond[:40], f"groups over {MAX_DEPTH} deep", "a few")
            raise _refused(path, beyond, "a link to another file", "data inside this file")
        file.visititems(lambda name, item: _check(path, name, item) if isinstance(item, h5py.Dataset) else None)
        yield file


def check_before_opening(path: str | os.PathLike) -> None:
    """Raise TactileError for a file on which the HDF5 library would use up all memory, and OSError. Fuzzing found two.

    The first begins with a driver's information, for which the library takes up to 4 GB whatever the file holds; only
    files in several parts have it. The second has an endless free list, see ``hdf5_free_lists``.
    """
    found = outside.check(path, "an HDF5 file")
    _check_bytes(os.fspath(path), found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)


@functools.lru_cache(maxsize=256)  # a prepared recording is opened for each shard
def _check_bytes(path: str, *_identity: int) -> None:
    with outside.open_file(path) as file:
        size, start = os.fstat(file.fileno()).st_size, 0
        while start < size:
            file.seek(start)
            block = file.read(64)
            if block.startswith(SIGNATURE):
                break
            start = 2 * start or 512  # where the library looks, too
    if start >= size or len(block) < 64:
        return
    if block[8] <= 1:  # the fourth address is the driver's (HDF5 file format, II.A); later superblocks have none
        width, length, addresses = block[13], block[14], 24 + 4 * block[8]
        if block[addresses + 3 * width : addresses + 4 * width].strip(b"\xff"):
            raise _refused(path, "superblock", "a driver's information: a file in several parts", "one whole file")
    else:
        width, length = block[9], block[10]
    if {width, length} <= WIDTHS:
        check_free_lists(path, start, width, length)


def declared(data: h5py.Dataset, where: str) -> None:
    """Raise TactileError for a dataset that declares more data than its stored bytes can unpack to."""
    stored = data.id.get_storage_size()
    if data.size * data.dtype.itemsize > MAX_RATIO * stored + STEP:
        found = f"shape {data.shape} in {stored} stored bytes"
        raise TactileError(where, found, "a dataset whose values are in the file", "Write the file again")


def check_plain(path: str | os.PathLike, data: h5py.Dataset) -> None:
    """Raise TactileError for a dataset other than plain numbers in this file, uncompressed, with or without checksums.

    Meant for the project's own files, of which a few rows are read many times: `open_checked` would check each chunk.
    """
    layout, name = data.id.get_create_plist(), data.name
    if layout.get_external_count() or data.is_virtual or data.dtype.kind not in "fiub":
        raise _refused(path, name, "no plain numbers", "numbers in this file")
    if any(layout.get_filter(index)[0] != CHECKSUM for index in range(layout.get_nfilters())):
        raise _refused(path, name, "packed values", "plain ones")
    if data.chunks is not None and math.prod(data.chunks) * data.dtype.itemsize > MAX_PLAIN_CHUNK:
        raise _refused(path, name, f"chunks of shape {data.chunks}", f"at most {MAX_PLAIN_CHUNK // 2**20} MB")


def _outside(name: bytes, link: h5py.h5l.LinkInfo) -> bytes | None:
    """Return the name of a link to another file or too deep in groups, which ends the walk; None for other links."""
    import h5py

    return name if link.type == h5py.h5l.TYPE_EXTERNAL or name.count(b"/") >= MAX_DEPTH else None


def _check(path: str | os.PathLike, name: str | bytes, data: h5py.Dataset) -> None:
    layout = data.id.get_create_plist()
    if layout.get_external_count() or data.is_virtual:
        raise _refused(path, name, "its values lie in other files", "data inside this file")
    if data.chunks is None:
        return
    size = data.dtype.itemsize
    for length in data.chunks:
        size *= length
    if size > MAX_CHUNK:
        raise _refused(path, name, f"chunks of {size / 2**20:.0f} MB", f"at most {MAX_CHUNK // 2**20} MB")
    filters = [layout.get_filter(index)[0] for index in range(layout.get_nfilters())]
    unknown = [number for number in filters if number not in FILTERS]
    if unknown:
        raise _refused(path, name, f"HDF5 filter {unknown[0]}", f"no other than {', '.join(FILTERS.values())}")
    if filters:
        data.id.chunk_iter(lambda chunk: _check_chunk(path, name, data, chunk, size, filters))


def _check_chunk(path, name, data, chunk, size: int, filters: list[int]) -> None:  # noqa: ANN001
    """Raise TactileError for a packed chunk that unpacks to more than its size, unless it is small enough."""
    if MAX_RATIO * chunk.size <= MAX_CHUNK:
        return
    if chunk.size > size + size // 8 + STEP:  # packing makes hardly more of what it cannot pack
        raise _refused(path, name, f"a chunk of {chunk.size} bytes for {size}", "chunks of their size")
    if DEFLATE in filters and _unpacked(data.id.read_direct_chunk(chunk.chunk_offset)[1], size) > size:
        raise _refused(path, name, f"a chunk that unpacks to more than {size} bytes", "chunks of their size")


def _unpacked(packed: bytes, limit: int) -> int:
    """Count the bytes that a deflate stream unpacks to, no further than just beyond `limit`."""
    unpacker, count = zlib.decompressobj(), 0
    try:
        while packed and not unpacker.eof and count <= limit:
            count += len(unpacker.decompress(packed, STEP))
            packed = unpacker.unconsumed_tail
    except zlib.error:
        pass  # damaged: HDF5 reports it when it is read
    return count


def _refused(path: str | os.PathLike, name: str | bytes, found: str, expected: str) -> TactileError:
    name = name.decode(errors="replace") if isinstance(name, bytes) else name
    return TactileError(f"{os.fspath(path)}, {name}", found, expected, "Write the file again with h5py or h5repack")
