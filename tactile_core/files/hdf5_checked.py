"""Read third-party HDF5 files safely: no other file is read, and no chunk unpacks to more than it declares."""

from __future__ import annotations

import contextlib
import math
import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from ..errors import TactileError
from . import outside
from .hdf5_heaps import Heaps

if TYPE_CHECKING:
    import h5py

MAX_CHUNK = 256 * 2**20  # bytes of an unpacked chunk (assumed enough: HDF5 advises 1 MB, and keeps one in memory)
MAX_RATIO = 1032  # the most that deflate packs (zlib, technical details); lzf at most 88
FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32", 32000: "lzf"}  # that are undone; the numbers are HDF5's
DEFLATE, CHECKSUM, STEP = 1, 3, 2**20
WIDTHS = {2, 4, 8, 16, 32}  # bytes of an address and of a size; the library opens no file with others
MOST_CHUNKS = 20_000  # read at a time: the library takes 4 kB for each while it reads, 80 MB
MAX_DEPTH = 32  # groups within groups, whose names the library looks up again and again (assumed enough; ours have 2)
MAX_PLAIN_CHUNK = 2**24  # bytes of a chunk in a file of our own; they have 0.2 MB
SIGNATURE, LONGEST = b"\x89HDF\r\n\x1a\n", 256  # LONGEST: bytes of the widest superblock up to the root's address


@contextmanager
def open_checked(path: str | os.PathLike) -> Iterator[h5py.File]:
    """Open for reading. Raises h5py's errors, and TactileError for a file that could take more memory than it declares.

    Refused: datasets in other files (external links, external or virtual storage), chunks of over 256 MB, filters other
    than gzip, lzf, shuffle and checksums, and chunks that unpack to more than their size. Reading a row then takes at
    most one chunk of memory beyond the row, reading a dataset takes its declared size, which the caller has to limit:
    see ``declared``.
    """
    import h5py

    with open_plain(path) as file:
        file.visititems(lambda name, item: _check(path, name, item) if isinstance(item, h5py.Dataset) else None)
        yield file


@contextmanager
def open_plain(path: str | os.PathLike) -> Iterator[h5py.File]:
    """Open for reading, with values unchecked. Raises h5py's errors; TactileError for what `open_checked` refuses else.

    Meant for files of plain numbers, see ``check_plain``. On two kinds of file, found by fuzzing, the HDF5 library
    would use up all memory: one begins with a driver's information, for which the library takes up to 4 GB whatever
    the file holds, and only files in several parts have it; the other has an endless free list, see ``hdf5_heaps``.
    """
    import h5py

    with contextlib.ExitStack() as stack:
        heaps = _heaps(path, stack)
        file = stack.enter_context(h5py.File(path, "r"))
        wrong = file.id.links.visit(lambda name, link: _link(path, heaps, name, link), info=True)
        if wrong is not None:
            raise wrong
        yield file


def _heaps(path: str | os.PathLike, stack: contextlib.ExitStack) -> Heaps | None:
    """Return the heaps of a file whose root may be opened, None for a file that the library does not open.

    Raises TactileError, and OSError. Places in the superblock: HDF5 file format, II.A.
    """
    block, start = _superblock(path)
    if not block:
        return None
    old = block[8] <= 1
    width, length = block[13:15] if old else block[9:11]
    if not {width, length} <= WIDTHS:
        return None
    fourth = (24 + 4 * block[8] if old else 12) + 3 * width  # the address of the driver's, in later ones of the root
    if old and block[fourth : fourth + width].strip(b"\xff"):
        raise _refused(path, "superblock", "a driver's information: a file in several parts", "one whole file")
    root = fourth + width + length if old else fourth
    heaps = stack.enter_context(Heaps(path, start, width, length))
    wrong = heaps.check_object(int.from_bytes(block[root : root + width], "little"))
    if wrong is not None:
        raise wrong
    return heaps


def _superblock(path: str | os.PathLike) -> tuple[bytes, int]:
    """Read the superblock and what follows it, LONGEST bytes, and where it begins; no bytes where there is none."""
    with outside.open_file(path, "an HDF5 file") as file:
        size, start = os.fstat(file.fileno()).st_size, 0
        while start < size:
            file.seek(start)
            block = file.read(LONGEST)
            if block.startswith(SIGNATURE):
                return block.ljust(LONGEST, b"\xff"), start
            start = 2 * start or 512  # where the library looks, too
    return b"", 0


def declared(data: h5py.Dataset, where: str) -> None:
    """Raise TactileError for a dataset that declares more data than its stored bytes can unpack to."""
    stored = data.id.get_storage_size()
    if data.size * data.dtype.itemsize > MAX_RATIO * stored + STEP:
        found = f"shape {data.shape} in {stored} stored bytes"
        raise TactileError(where, found, "a dataset whose values are in the file", "Write the file again")


def read_rows(data: h5py.Dataset, rows: slice | None = None) -> np.ndarray:
    """Read a dataset, or some rows of it, at most MOST_CHUNKS of its chunks at a time.

    Raises TactileError for a row of more.
    """
    if data.chunks is None or not data.ndim:
        return data[()] if rows is None else data[rows]
    start, stop, _ = (rows or slice(None)).indices(len(data))
    in_row = math.prod(-(-size // chunk) for size, chunk in zip(data.shape[1:], data.chunks[1:], strict=True))
    if in_row > MOST_CHUNKS:
        raise _refused(data.file.filename, data.name, f"{in_row:,} chunks a row", f"at most {MOST_CHUNKS:,}")
    step = data.chunks[0] * (MOST_CHUNKS // in_row) if in_row else len(data)
    if stop - start <= step:
        return data[start:stop]
    return np.concatenate([data[first : min(first + step, stop)] for first in range(start, stop, step)])


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


def _link(path: str | os.PathLike, heaps: Heaps | None, name: bytes, link: h5py.h5l.LinkInfo) -> TactileError | None:
    """Return what is wrong with a link, before the library follows it, which ends the walk; None for a good one."""
    import h5py

    if name.count(b"/") >= MAX_DEPTH:
        return _refused(path, name[:40], f"groups over {MAX_DEPTH} deep", "a few")
    if link.type == h5py.h5l.TYPE_EXTERNAL:
        return _refused(path, name, "a link to another file", "data inside this file")
    return heaps.check_object(link.u) if heaps and link.type == h5py.h5l.TYPE_HARD else None


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
