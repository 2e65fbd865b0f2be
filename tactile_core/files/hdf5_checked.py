"""Read third-party HDF5 files safely: no other file is read, and no chunk unpacks to more than it declares."""

from __future__ import annotations

import contextlib
import functools
import math
import os
import sys
import threading
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from ..errors import TactileError
from . import outside

if TYPE_CHECKING:
    import h5py


MAX_CHUNK = 256 * 2**20  # bytes of an unpacked chunk (assumed enough: HDF5 advises 1 MB, and keeps one in memory)
MAX_RATIO = 1032  # the most that deflate packs (zlib, technical details); lzf at most 88
FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32", 32000: "lzf"}  # that are undone; the numbers are HDF5's
DEFLATE, STEP = 1, 2**20
MOST_CHUNKS = 20_000  # read at a time: the library takes 4 kB for each while it reads, 80 MB
MAX_DEPTH = 32  # groups within groups, whose names the library looks up again and again (assumed enough; ours have 2)
SIGNATURE = b"\x89HDF\r\n\x1a\n"
MAX_OPENING = 128 * 2**20  # bytes that names and headers may take (assumed enough: the library keeps at most 32 MB)


@contextmanager
def bounded_memory(more: int) -> Iterator[None]:
    """Let the process take at most ``more`` bytes beyond its present data in the block; larger allocations fail. It
    acts on Linux, in the main thread alone: other systems have no such limit, and in a Dask worker, which has its own,
    other threads' work would fail."""
    if not sys.platform.startswith("linux") or threading.current_thread() is not threading.main_thread():
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    with open("/proc/self/statm") as file:
        present = int(file.read().split()[5]) * resource.getpagesize()
    limits = [present + more, *(limit for limit in before if limit != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_DATA, (min(limits), before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


@contextmanager
def open_checked(path: str | os.PathLike) -> Iterator[h5py.File]:
    """Open an HDF5 file to read. Raises h5py's errors, and TactileError for what may take more memory than it declares.

    Refused are datasets in other files (external links, external or virtual storage), chunks of over 256 MB, filters
    other than gzip, lzf, shuffle and checksums, and chunks that unpack to more than their size. To read a row then
    takes at most one chunk beyond the row; a dataset takes its declared size, which the caller has to limit by
    ``declared``. Every object is opened once under `bounded_memory`: fuzzing found two kinds of file with which the
    HDF5 library (up to 2.0) uses up all memory, one with driver information of up to 4 GB, one with a circular list of
    free places."""
    import h5py

    outside.check(path, "an HDF5 file")
    packed: list[tuple[str, h5py.Dataset, int, list[int]]] = []
    with contextlib.ExitStack() as stack:
        with bounded_memory(MAX_OPENING):
            file = stack.enter_context(h5py.File(path, "r"))
            try:
                if wrong := file.id.links.visit(functools.partial(_check_link, path), info=True):
                    raise wrong
                file.visititems(lambda name, item: packed.extend(_check(path, name, item)))
            except (RuntimeError, MemoryError) as error:  # what the library says of what it cannot read
                expected = f"a whole file, opened in {MAX_OPENING // 2**20} MB"
                raise _refused(path, "its groups", str(error), expected) from error
        for name, data, size, filters in packed:  # what unpacks may take more memory than opening does
            data.id.chunk_iter(functools.partial(_check_chunk, path, name, data, size=size, filters=filters))
        yield file


def declared(data: h5py.Dataset, where: str) -> None:
    """Raise TactileError, on ``where``, for a dataset that declares more than its stored bytes can unpack to."""
    stored = data.id.get_storage_size()
    if data.size * data.dtype.itemsize > MAX_RATIO * stored + STEP:
        found = f"shape {data.shape} in {stored} stored bytes"
        raise TactileError(where, found, "a dataset whose values are in the file", "Write the file again")


def read_rows(data: h5py.Dataset, rows: slice | None = None) -> np.ndarray:
    """Return a dataset's array, or some rows, read in small parts. Raises TactileError for a row of too many chunks."""
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


def _check_link(path: str | os.PathLike, name: bytes, link: h5py.h5l.LinkInfo) -> TactileError | None:
    """Return the error of a link to another file or too deep, before the library follows it (which cannot pass on what
    is raised here); None for a good one."""
    import h5py

    if name.count(b"/") >= MAX_DEPTH:
        return _refused(path, name[:40], f"groups over {MAX_DEPTH} deep", "a few")
    if link.type == h5py.h5l.TYPE_EXTERNAL:
        return _refused(path, name, "a link to another file", "data inside this file")
    return None


def _check(path: str | os.PathLike, name: str, data: h5py.Dataset | h5py.Group) -> list:
    """Return [(name, dataset, bytes of a chunk, filters)] if a dataset's chunks are packed, else []. Raises
    TactileError for values in other files, large chunks and unknown filters."""
    if not hasattr(data, "chunks"):
        return []
    layout = data.id.get_create_plist()
    if layout.get_external_count() or data.is_virtual:
        raise _refused(path, name, "its values lie in other files", "data inside this file")
    if data.chunks is None:
        return []
    size = math.prod(data.chunks) * data.dtype.itemsize
    if size > MAX_CHUNK:
        raise _refused(path, name, f"chunks of {size / 2**20:.0f} MB", f"at most {MAX_CHUNK // 2**20} MB")
    filters = [layout.get_filter(index)[0] for index in range(layout.get_nfilters())]
    unknown = [number for number in filters if number not in FILTERS]
    if unknown:
        raise _refused(path, name, f"HDF5 filter {unknown[0]}", f"no other than {', '.join(FILTERS.values())}")
    return [(name, data, size, filters)] if filters else []


def _check_chunk(path, name, data, chunk, size: int, filters: list[int]) -> None:  # noqa: ANN001
    """Raise TactileError for a packed chunk that may take over `MAX_CHUNK` and unpacks to more than its size."""
    if MAX_RATIO * chunk.size <= MAX_CHUNK:
        return
    if chunk.size > size + size // 8 + STEP:  # packing makes hardly more of what it cannot pack
        raise _refused(path, name, f"a chunk of {chunk.size} bytes for {size}", "chunks of their size")
    if DEFLATE in filters and _unpacked(data.id.read_direct_chunk(chunk.chunk_offset)[1], size) > size:
        raise _refused(path, name, f"a chunk that unpacks to more than {size} bytes", "chunks of their size")


def _unpacked(packed: bytes, limit: int) -> int:
    """Return the number of bytes that a deflate stream unpacks to, counted until just beyond `limit`."""
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
