"""Check the local heaps of third-party HDF5 files, which hold the names of an old-style group.

A heap lists its free places, each with the place of the next. The library (up to 2.0) follows a circular list until no
memory is left (found by fuzzing: one changed byte in 32 kB).
"""

from __future__ import annotations

import mmap
import os
import re

from ..errors import TactileError

SIGNATURE, VERSION = re.compile(b"HEAP"), 0
END = 1  # what the last free place names as the next (HDF5 file format, III.D)
MOST_OF_HEAP, MOST = 10_000, 1_000_000  # free places of a heap, and of a file (assumed enough; a heap has a few)


def check_free_lists(path: str | os.PathLike, start: int, width: int, length: int) -> None:
    """Raise TactileError for a file whose list of free places does not end. The file is read once.

    start : byte of the superblock, from which addresses count; width, length : bytes of an address and of a size
    """
    left = MOST
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for found in SIGNATURE.finditer(data, start):  # twice as fast as the file's own find
            place = found.start()
            count = _free_places(data, place, start, width, length)
            left -= count
            if left <= 0 or (count >= MOST_OF_HEAP and _named(data, place - start, width)):
                endless, advice = "a list of free places without end", "Write the file again with h5py or h5repack"
                raise TactileError(f"{os.fspath(path)}, byte {place}", endless, "a whole HDF5 file", advice)


def _free_places(data: mmap.mmap, place: int, start: int, width: int, length: int) -> int:
    """Count the free places that a heap lists, up to MOST_OF_HEAP; an entry that the library refuses ends the list.

    The header: signature, version, three bytes, size of the heap's data, first free place in them, their address. A
    free place: the next one, its own size.
    """

    def number(at: int, size: int) -> int:
        """Read an unsigned integer of ``size`` bytes at byte ``at``."""
        return int.from_bytes(data[at : at + size], "little")

    if data[place + 4 : place + 5] != bytes([VERSION]):
        return 0
    size, free = number(place + 8, length), number(place + 8 + length, length)
    address, count = start + number(place + 8 + 2 * length, width), 0
    last = min(size, len(data) - address) - 2 * length
    while free not in (0, END) and free <= last and count < MOST_OF_HEAP:
        if free + number(address + free + length, length) > size:
            break
        free, count = number(address + free, length), count + 1
    return count


def _named(data: mmap.mmap, address: int, width: int) -> bool:
    """Return true if the file contains this address, as a group names its heap's; other heaps are part of values."""
    return address < 256**width and data.find(address.to_bytes(width, "little")) >= 0
