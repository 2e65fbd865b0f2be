"""MATLAB 5 files as named arrays, read by scipy (extra [matlab]), which executes nothing in them."""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO

import numpy as np

from ...errors import TactileError
from ...files import installed
from ...files.outside import damage_reported
from ..array_store import Store

START, START_OF_HDF5 = b"MATLAB 5", b"MATLAB 7"  # of MATLAB 7.3
CLASSES = {
    "double": "f8", "single": "f4", "logical": "?", **{f"{sign}int{bits}": f"{code}{bits // 8}"
    for sign, code in (("", "i"), ("u", "u")) for bits in (8, 16, 32, 64)},
}  # fmt: skip
REFUSED = ("object", "opaque", "function")
MOST_VARIABLES = 1000  # of one file (assumed enough)
MOST_UNPACKED = 512 * 2**20  # bytes of one variable; 19 electrodes of two million frames as doubles take 300 MB
HEADER, PACKED, STEP = 128, 15, 2**20  # bytes; type of a packed element (MAT-file format, level 5); bytes at a time


@contextmanager
def open_matlab(path: str, file: BinaryIO) -> Iterator[Store]:
    """Open a MATLAB 5 file's arrays. Raises TactileError for objects and damage, and if scipy is not installed."""
    with damage_reported(path, "MATLAB file"):
        _check_unpacked(path, file)
    try:
        from scipy.io import loadmat, whosmat
    except ModuleNotFoundError as error:
        advice = installed.advice("matlab")
        raise TactileError(path, "a MATLAB file, which scipy reads", "scipy", advice) from error
    with damage_reported(path, "MATLAB file"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of variables that are there twice: the first is read
        listed = whosmat(file)
    names = [name for name, _, _ in listed]
    if len(names) > MOST_VARIABLES or len(set(names)) < len(names):
        found = f"{len(names)} variables, {len(names) - len(set(names))} of them twice"
        raise TactileError(path, found, f"at most {MOST_VARIABLES}, each once", "Save them again")
    for name, _, kind in listed:
        if kind in REFUSED:
            advice = "Save the plain arrays alone"
            raise TactileError(f"{path}, {name:.80}", f"a MATLAB {kind}", "arrays of numbers", advice)
    shapes = {name: (tuple(shape), np.dtype(CLASSES.get(kind, "O"))) for name, shape, kind in listed}

    def load(name: str) -> np.ndarray:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = loadmat(file, variable_names=[name])[name]
        if found.shape != shapes[name][0] or found.dtype.kind not in "iufb":
            raise ValueError(f"{found.dtype} of shape {found.shape} where {shapes[name][1]} is declared")
        return found

    yield Store(path, shapes, load)


def _check_unpacked(path: str, file: BinaryIO) -> None:
    """Raise TactileError for a compressed variable of more than MOST_UNPACKED bytes, which scipy would load."""
    file.seek(0)
    order = {b"IM": "<", b"MI": ">"}[file.read(HEADER)[-2:]]
    while len(tag := file.read(8)) == 8:
        kind, length = struct.unpack(f"{order}II", tag)
        end = file.tell() + length
        if kind == PACKED:
            _check_packed(path, file, length)
        file.seek(end)


def _check_packed(path: str, file: BinaryIO, length: int) -> None:
    unpacker, total = zlib.decompressobj(), 0
    while length > 0 and (data := file.read(min(length, STEP))):
        length -= len(data)
        while data:
            total += len(unpacker.decompress(data, STEP))
            data = unpacker.unconsumed_tail
            if total > MOST_UNPACKED:
                found = f"a variable that unpacks to more than {MOST_UNPACKED // 2**20} MB"
                raise TactileError(path, found, "less", "Split the recording")
