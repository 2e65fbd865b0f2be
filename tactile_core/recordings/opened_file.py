"""Open a file of recordings once, and detect what it is from its first bytes, not from its name."""

from __future__ import annotations

import gzip
import io
import os
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, NamedTuple

from ..errors import TactileError
from ..files import outside
from ..files.hdf5_checked import SIGNATURE
from .array_store import MATLAB, MATLAB_73, NPY
from .bags.bag import START_BYTES, is_bag_folder, kind_of
from .recording import split
from .tables.json_table import is_json
from .tables.table import MAX_BYTES

FOLDER_ENDINGS = (".csv", ".h5", ".hdf5", ".npz", ".bag", ".mcap", ".db3", ".mat")  # of what is taken from a folder
ENDINGS = (*FOLDER_ENDINGS, ".npy", ".json", ".jsonl", ".txt", ".tsv", ".gz")  # of all that is read, some by a map
ZIP_STARTS = (b"PK\x03\x04", b"PK\x05\x06")
UNZIP = "unzip; of a spreadsheet save the sheet as CSV"
PACKED = {b"BZh": "bunzip2", b"\xfd7zXZ": "unxz", b"\x28\xb5\x2f\xfd": "unzstd", ZIP_STARTS[0]: UNZIP}
NPY_NAME = b".npy"  # how arrays in an NPZ file, a zip, are called
HEAD, DIRECTORY = 1024, 2**16  # bytes in which the first one's name is; at a zip's end, in which all names are


class Opened(NamedTuple):
    """An open file of recordings.
    container : "csv", "json", "hdf5", "npz", "mat" or "bag"; path : the file's, without #finger
    finger : number of the finger that the path named, or None; file : its bytes, unzipped; empty for a bag's folder"""

    container: str
    path: str
    finger: int | None
    file: BinaryIO


@contextmanager
def opened(path: str) -> Iterator[Opened]:
    """Open a file, or the one in ``path#finger``, and detect its kind from its first bytes. Raises TactileError if it
    is missing or packed, or of a kind without fingers or topics, and for the system's errors in the block."""
    try:
        file, finger, topic = split(path)
        if is_bag_folder(file):
            yield Opened("bag", file, finger, io.BytesIO())
            return
        _check_file(file)
        with outside.open_file(file, "a recording") as stream, unpacked(file, stream) as plain:
            head = plain.read(HEAD)
            start = head[:START_BYTES]
            for packed, program in PACKED.items():
                if start.startswith(packed) and NPY_NAME not in head + _end(plain):
                    raise TactileError(file, "a packed file", "a recording, or a gzipped text", f"Unpack it: {program}")
            container = _container(start)
            if plain is not stream and container not in ("csv", "json"):
                raise TactileError(file, f"a gzipped file ({container})", "a gzipped text", "Unpack it: gunzip")
            if container in ("hdf5", "npz"):
                refuse_finger(file, finger)
            if topic and container != "bag":
                raise TactileError(file, f"topic {topic!r} of a file without topics", "path, or path#finger")
            plain.seek(0)
            yield Opened(container, file, finger, plain)
    except OSError as error:
        advice = "Check the path and its permissions"
        raise TactileError(path, error.strerror or str(error), "a readable file", advice) from error
    except MemoryError as error:
        raise TactileError(path, "too large for this machine's memory", advice="Split the recording") from error


def _end(file: BinaryIO) -> bytes:
    """Return the last ``DIRECTORY`` bytes of a file."""
    file.seek(max(file.seek(0, os.SEEK_END) - DIRECTORY, 0))
    return file.read()


def container_of(path: str) -> str:
    """Return a file's container: "csv", "json", "hdf5", "npz", "mat" or "bag". Raises TactileError for no file."""
    with opened(path) as found:
        return found.container


def _check_file(path: str) -> None:
    if os.path.isdir(path):
        scene = os.path.isfile(os.path.join(path, "scene.toml"))
        advice = "Simulate it first: tactile simulate" if scene else "Name the recording inside the folder"
        raise TactileError(path, "a scene" if scene else "a folder", "one recording file", advice)
    if not os.path.exists(path):
        advice = "Check the path; to try with a recording that ships: tactile scenes copy press_roll_slide"
        raise TactileError(path, "there is no such file", "a recording (CSV, HDF5, NPZ, MAT, JSON or bag)", advice)
    if not os.path.isfile(path):
        raise TactileError(path, "not a regular file", "a recording (CSV, HDF5, NPZ, MAT, JSON or bag)")


def _container(start: bytes) -> str:
    """Return the container of a file that starts with these bytes; "csv" if they are no known signature."""
    if kind_of(start) is not None:
        return "bag"
    if start.startswith(MATLAB):
        return "mat"
    if start.startswith((SIGNATURE, MATLAB_73)):
        return "hdf5"
    if start.startswith((*ZIP_STARTS, NPY)):
        return "npz"
    return "json" if is_json(start) else "csv"


def refuse_finger(path: str, finger: int | None) -> None:
    """Raise TactileError if a finger's number is given, for a file that holds only one."""
    if finger is not None:
        raise TactileError(path, f"finger {finger} of a file of one", "one recording", "Leave out the #")


GZIP, STEP = b"\x1f\x8b", 2**20


@contextmanager
def unpacked(path: str, file: BinaryIO) -> Iterator[BinaryIO]:
    """Yield the file from its start, unpacked if gzipped. Raises TactileError for damage and a too long text."""
    packed = file.read(len(GZIP)) == GZIP
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
