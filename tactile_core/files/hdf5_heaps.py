"""Check the local heaps of third-party HDF5 files, which hold the names of an old-style group, before they are loaded.

A heap lists its free places, each with the place of the next. The library (up to 2.0) follows a circular list until no
memory is left (found by fuzzing: one changed byte in 32 kB). Only what is reached is read: an object's header names its
heap. Layouts as in the HDF5 file format specification, III.D (heaps) and IV.A (object headers).
"""

from __future__ import annotations

import os
from collections.abc import Iterator

from ..errors import TactileError
from . import outside

HEAP, OBJECT, CONTINUED, END = b"HEAP", b"OHDR", b"OCHK", 1  # END: what the last free place names as the next
MOST_OF_HEAP, MOST_FREE = 10_000, 1_000_000  # free places of a heap, and of a file (assumed enough; a heap has a few)
MOST_MESSAGES = 5_000_000  # of all headers, which takes 4 s; a dataset has 8 (assumed enough)
EXTERNAL, CONTINUATION, SYMBOLS = 7, 16, 17  # messages that name a heap or more messages; the numbers are HDF5's


class Heaps:
    """The heaps of one file. Closes the file at the end of a ``with`` block."""

    def __init__(self, path: str | os.PathLike, start: int, width: int, length: int) -> None:
        """Open the file. start : byte from which addresses count; width, length : bytes of an address and of a size."""
        self._path, self._start, self._width, self._length = os.fspath(path), start, width, length
        self._seen: set[int] = set()
        self._messages_left, self._free_left = MOST_MESSAGES, MOST_FREE
        self._file = outside.open_file(path)  # not mapped: a file cut meanwhile would end the process
        self._size = os.fstat(self._file.fileno()).st_size

    def __enter__(self) -> Heaps:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def check_object(self, address: int) -> TactileError | None:
        """Return what is wrong with the heaps that the object at this address names, None if nothing is.

        It is returned, not raised, as h5py's walks end by a value. What the library refuses itself is not looked at.
        """
        for kind, body, end in self._messages(address):
            self._messages_left -= 1
            if self._messages_left < 0:
                return self._refused(address, f"over {MOST_MESSAGES:,} messages in headers of objects")
            if kind in (EXTERNAL, SYMBOLS):
                place = body + (8 if kind == EXTERNAL else self._width)  # the heap's address within the message
                heap = self._number(place, self._width) if place + self._width <= end else None
                if heap is not None and self._endless(self._start + heap):
                    return self._refused(heap, "a list of free places without end")
        return None

    def _messages(self, address: int) -> Iterator[tuple[int, int, int]]:
        """Yield the kind, first byte and end of each message of an object's header, once a file."""
        place = self._start + address
        if self._bytes(place, 4) == OBJECT:
            flags, first = self._number(place + 5, 1), place + 6
            first += 16 * bool(flags & 32) + 4 * bool(flags & 16)  # times, and when attributes are kept apart
            sized = 1 << (flags & 3)
            parts, head, wide = [(first + sized, self._number(first, sized))], 4 + 2 * bool(flags & 4), 1
        else:
            parts, head, wide = [(place + 16, self._number(place + 8, 4))], 8, 2
        for start, size in parts:  # grows
            if start in self._seen:
                continue
            self._seen.add(start)
            end, at = min(start + size, self._size), start
            while at + head <= end:
                kind, body = self._number(at, wide), at + head
                at = body + self._number(at + wide, 2)
                if at > end:
                    break
                if kind == CONTINUATION and body + self._width + self._length <= at:
                    more = self._start + self._number(body, self._width)
                    size = self._number(body + self._width, self._length)
                    later = wide == 1 and self._bytes(more, 4) == CONTINUED
                    parts.append((more + 4, size - 8) if later else (more, size))  # between signature and checksum
                yield kind, body, at

    def _endless(self, place: int) -> bool:
        """Return true if a heap lists too many free places; an entry that the library refuses ends the list.

        The header: signature, version 0, three bytes, size of the heap's data, first free place in them, their address.
        A free place: the next one, its own size.
        """
        if self._bytes(place, 5) != HEAP + b"\0":
            return False
        size, free = self._number(place + 8, self._length), self._number(place + 8 + self._length, self._length)
        values, count = self._start + self._number(place + 8 + 2 * self._length, self._width), 0
        last = min(size, self._size - values) - 2 * self._length
        while free != END and free <= last and count < MOST_OF_HEAP:
            if free + self._number(values + free + self._length, self._length) > size:
                break
            free, count = self._number(values + free, self._length) or END, count + 1
        self._free_left -= count
        return count >= MOST_OF_HEAP or self._free_left < 0

    def _number(self, at: int, size: int) -> int:
        """Read an unsigned integer of ``size`` bytes at byte ``at``; what lies beyond the file counts as 0."""
        return int.from_bytes(self._bytes(at, size), "little")

    def _bytes(self, at: int, size: int) -> bytes:
        if at >= self._size:
            return b""
        self._file.seek(at)
        return self._file.read(size)

    def _refused(self, address: int, found: str) -> TactileError:
        where, advice = f"{self._path}, byte {self._start + address}", "Write the file again with h5py or h5repack"
        return TactileError(where, found, "a whole HDF5 file", advice)
