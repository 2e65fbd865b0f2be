"""Named arrays of an HDF5, NPZ or MATLAB 5 file, with their declared size checked before a byte of them is read."""

from __future__ import annotations

import io
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from math import prod
from typing import Any, BinaryIO

import numpy as np

from ..errors import TactileError
from ..files import installed
from ..files.hdf5_checked import declared, open_checked, read_rows
from ..files.outside import damage_reported
from .assemble import MAX_FRAMES
from .labels import LONGEST

# Bytes of one array in memory; a truth of 700 frames and 6,000 nodes takes 50 MB as float32 (assumed enough).
MAX_BYTES = 2 * 2**30
MAX_HEADER = 10_000  # bytes of an array's header in NPZ, numpy's own limit
# Attributes of packed numbers in netCDF (CF conventions, Packed Data), with the values that change nothing.
SCALED = {"scale_factor": 1, "add_offset": 0}
NPY = b"\x93NUMPY"
_NPY_START = 12  # bytes: magic, version, length
MATLAB, MATLAB_73 = b"MATLAB 5", b"MATLAB 7"  # how a file starts; the latter is HDF5
CLASSES = {
    "double": "f8", "single": "f4", "logical": "?", **{f"{sign}int{bits}": f"{code}{bits // 8}"
    for sign, code in (("", "i"), ("u", "u")) for bits in (8, 16, 32, 64)},
}  # fmt: skip
REFUSED = ("object", "opaque", "function")
MOST_VARIABLES = 1000  # of one MATLAB file (assumed enough)
MOST_UNPACKED = 512 * 2**20  # bytes of one variable; 19 electrodes of two million frames as doubles take 300 MB
HEADER, PACKED, STEP = 128, 15, 2**20  # bytes; type of a packed element (MAT-file format, level 5); bytes at a time


@dataclass(frozen=True)
class Store:
    """Named arrays of an open file, read on demand.
    shapes : array's name -> shape and type that the file declares; taken : names of the arrays that were read so far
    load, load_rows : functions that read an array by name, or some of its rows (None: the file cannot be read in parts)
    attributes : the file's own, at its root; attributes_of : function from an array's name to its attributes"""

    path: str
    shapes: dict[str, tuple[tuple[int, ...], np.dtype]]
    load: Callable[[str], np.ndarray]
    attributes: dict[str, Any] = field(default_factory=dict)
    attributes_of: Callable[[str], dict[str, Any]] = lambda name: {}
    load_rows: Callable[[str, slice], np.ndarray] | None = None
    taken: set[str] = field(default_factory=set)

    def is_text(self, name: str) -> bool:
        """Return true if an array holds texts of a fixed length up to `LONGEST` characters, or of variable length."""
        kind = self.shapes[name][1]
        short = kind.kind in "SU" and kind.itemsize <= 4 * LONGEST
        return short or (kind.metadata is not None and kind.metadata.get("vlen") in (str, bytes))

    def texts(self, name: str) -> list[str]:
        """Return an array's texts, flat, each cut to `LONGEST` characters; those of variable length are read singly."""
        self.taken.add(name)
        shape, kind = self.shapes[name]
        if prod(shape) > MAX_FRAMES:
            where = f"{self.path}, {name}"
            raise TactileError(where, f"shape {shape}", f"at most {MAX_FRAMES:,} frames", "Split the recording")
        if kind.hasobject and shape and self.load_rows is not None:
            parts = (self.load_rows(name, slice(row, row + 1)) for row in range(shape[0]))
        else:
            parts = (self._loaded(name) for _ in range(1))
        return [_plain(each)[:LONGEST] for part in parts for each in np.ravel(part).tolist()]

    def rows(self, rows: slice, count: int) -> Store:
        """Return the store with arrays of length `count` cut to these rows, which HDF5 files alone can read singly."""
        long = {name for name, (shape, _) in self.shapes.items() if shape[:1] == (count,)}
        cut = {name: ((rows.stop - rows.start, *self.shapes[name][0][1:]), self.shapes[name][1]) for name in long}

        def load(name: str) -> np.ndarray:
            return self.load_rows(name, rows) if self.load_rows and name in long else self.load(name)

        return replace(self, shapes=self.shapes | cut, load=load)

    def array(self, name: str, shape: tuple[int | None, ...], dtype: type = np.float64) -> np.ndarray:
        """Return an array of numbers as ``dtype``; shape : the expected one, None for an axis of any length.
        Raises TactileError if the array is missing, damaged, not of numbers, of another shape, or too large."""
        where = f"{self.path}, {name}"
        if name not in self.shapes:
            raise TactileError(where, "this array is missing", advice="Export the recording again with all arrays")
        self.taken.add(name)
        found, kind = self.shapes[name]
        if kind.kind not in "iufb":
            raise TactileError(where, f"values of type {kind}", "numbers")
        wanted = "(" + ", ".join("frames" if n is None else str(n) for n in shape) + ")"
        if len(found) != len(shape) or any(n is not None and n != m for n, m in zip(shape, found, strict=False)):
            raise TactileError(where, f"shape {found}", wanted)
        bytes_needed = int(np.prod([float(n) for n in found])) * max(kind.itemsize, np.dtype(dtype).itemsize)
        if bytes_needed > MAX_BYTES or (found and found[0] > MAX_FRAMES):
            held = f"shape {found}, {bytes_needed / 2**30:.1f} GB in memory"
            expected = f"at most {MAX_FRAMES:,} frames and {MAX_BYTES / 2**30:.0f} GB"
            raise TactileError(where, held, expected, "Split the recording")
        return self._loaded(name).astype(dtype, copy=False)

    def optional(self, name: str, shape: tuple[int | None, ...]) -> np.ndarray | None:
        """Return the array `name` by `array`, or None if the file has none of that name."""
        return self.array(name, shape) if name in self.shapes else None

    def _loaded(self, name: str) -> np.ndarray:
        with damage_reported(f"{self.path}, {name}", "data"):
            return np.asarray(self.load(name))


@contextmanager
def open_hdf5(path: str) -> Iterator[Store]:
    """Open an HDF5 file to read; arrays are named by their full path without the first slash."""
    import h5py

    shapes: dict[str, tuple[tuple[int, ...], np.dtype]] = {}

    def note(name: str | bytes, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            shapes[_plain(name)] = (tuple(item.shape), item.dtype)

    with ExitStack() as stack:
        with damage_reported(path, "HDF5"):
            file = stack.enter_context(open_checked(path))
            file.visititems(note)
            attributes = {key: _plain(value) for key, value in file.attrs.items()}

        def attributes_of(name: str) -> dict[str, Any]:
            with damage_reported(f"{path}, {name}", "attributes"):
                return {key: _plain(value) for key, value in file[name].attrs.items()}

        def load(name: str, rows: slice | None = None) -> np.ndarray:
            """Return an array, or rows of it. Raises TactileError if it is packed or declares more than is stored."""
            declared(file[name], f"{path}, {name}")
            for attribute, neutral in SCALED.items():
                if np.any(file[name].attrs.get(attribute, neutral) != neutral):
                    advice = "Unpack it, as xarray's open_dataset does, and write it anew"
                    raise TactileError(f"{path}, {name}", f"packed values ({attribute})", "plain numbers", advice)
            return read_rows(file[name], rows)

        yield Store(path, shapes, load, attributes, attributes_of, load)


def _plain(value: Any) -> Any:
    """Convert a name or attribute to plain Python: str, int, float, bool or list, fit for JSON."""
    if isinstance(value, bytes):  # h5py gives text as bytes where it is not UTF-8
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | int | float | bool) else str(value)


@contextmanager
def open_npz(path: str, file: BinaryIO) -> Iterator[Store]:
    """Open NPZ, or NPY as array ``electrodes``, never unpickling. Raises TactileError for damage or odd packing."""
    if file.read(len(NPY)) == NPY:
        file.seek(0)
        with damage_reported(path, "NPY"):
            header = _npy_header(file)

        def load_whole(name: str) -> np.ndarray:
            file.seek(0)
            return np.lib.format.read_array(file, allow_pickle=False)

        yield Store(path, {"electrodes": header}, load_whole)
        return
    shapes: dict[str, tuple[tuple[int, ...], np.dtype]] = {}
    with ExitStack() as stack:
        with damage_reported(path, "NPZ"):
            archive = stack.enter_context(zipfile.ZipFile(file))
            for member in archive.infolist():
                if not member.filename.endswith(".npy"):
                    shapes[member.filename] = ((), np.dtype(object))  # no array, but named as not taken
                else:
                    _check_packing(path, member)
                    if member.filename[:-4] in shapes:
                        advice = "Save it again"
                        raise TactileError(f"{path}, {member.filename}", "there twice", "each array once", advice)
                    with archive.open(member) as stream:
                        shapes[member.filename[:-4]] = _npy_header(stream)

        def load(name: str) -> np.ndarray:
            with archive.open(name + ".npy") as stream:
                return np.lib.format.read_array(stream, allow_pickle=False)

        yield Store(path, shapes, load)


def _check_packing(path: str, member: zipfile.ZipInfo) -> None:
    """Raise TactileError for a member packed by another method than deflate: it may unpack to gigabytes at once."""
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        found = f"packed by method {member.compress_type}"
        raise TactileError(f"{path}, {member.filename}", found, "stored or deflated, as numpy does", "Save it again")


def _npy_header(stream: Any) -> tuple[tuple[int, ...], np.dtype]:
    """Return the shape and type in an array's header. Raises ValueError for one over `MAX_HEADER` bytes."""
    start = stream.read(_NPY_START)
    length = int.from_bytes(start[8 : 10 if start[6:7] == b"\1" else 12], "little")
    if not start.startswith(NPY) or length > MAX_HEADER:
        raise ValueError(f"a header of {length} bytes")
    whole = io.BytesIO(start + stream.read(length))
    version = np.lib.format.read_magic(whole)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(whole)
    return tuple(int(n) for n in shape), dtype


@contextmanager
def open_matlab(path: str, file: BinaryIO) -> Iterator[Store]:
    """Open a MATLAB 5 file's arrays by scipy, which executes nothing in them. Raises TactileError for objects, for
    damage, and if scipy (extra [matlab]) is not installed."""
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
        unpacker, total = zlib.decompressobj(), 0
        while kind == PACKED and (data := file.read(min(end - file.tell(), STEP))):
            while data:
                total += len(unpacker.decompress(data, STEP))
                data = unpacker.unconsumed_tail
                if total > MOST_UNPACKED:
                    found = f"a variable that unpacks to more than {MOST_UNPACKED // 2**20} MB"
                    raise TactileError(path, found, "less", "Split the recording")
        file.seek(end)
