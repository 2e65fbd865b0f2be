"""HDF5 files that ask for far more than they hold: each loader says no, within the memory of ``bounded_child``."""

import os
import re
import struct
import sys
import zlib
from concurrent.futures import ThreadPoolExecutor

import h5py
import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.files import checksummed, hdf5_checked
from tactile_core.jobs import prepared_signals
from tactile_core.simulation import pairs_file

pytest.importorskip("resource", reason="Windows limits no process's memory")
from bounded_child import BOUND, prepare, refused, report_of


def electrodes(path, **more):
    with h5py.File(path, "w") as file:
        return file.create_dataset("electrode_vals/data", **more).id


def huge_shape(path):
    electrodes(path, shape=(10**12, 19), dtype="f8", chunks=(1000, 19))


def many_frames_of_nothing(path):
    """Under the limit of frames and bytes, none of them stored."""
    electrodes(path, shape=(4_000_000, 19), dtype="i2", chunks=(1000, 19))


def huge_chunk(path):
    electrodes(path, shape=(10**7, 19), dtype="f8", chunks=(10**7, 19), compression="gzip")


def packed_zeros(count: int) -> bytes:
    """A deflate stream of zeros: a stretch of 16 MB, again and again."""
    stretch = zlib.compressobj(9, zlib.DEFLATED, -15)
    again = stretch.compress(bytes(2**24)) + stretch.flush(zlib.Z_FULL_FLUSH)
    return b"\x78\xda" + again * (count // 2**24)


PACKED = packed_zeros(2 * BOUND)


def chunk_bomb(path):
    """A chunk of 4 MB by its declaration that unpacks to twice BOUND."""
    with h5py.File(path, "w") as file:
        data = file.create_dataset("electrode_vals/data", (27_000, 19), "f8", chunks=(27_000, 19), compression="gzip")
        data.id.write_direct_chunk((0, 0), PACKED)


def external_storage(path):
    electrodes(path, shape=(60, 19), dtype="u1", external=[("/etc/passwd", 0, 60 * 19)])


def external_link(path):
    with h5py.File(path, "w") as file:
        file["electrode_vals/data"] = h5py.ExternalLink("/etc/hostname", "/x")


def virtual_storage(path):
    layout = h5py.VirtualLayout((60, 19), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", (60, 19))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("electrode_vals/data", layout)


def strange_filter(path):
    electrodes(path, shape=(60, 19), dtype="i4", chunks=(60, 19), scaleoffset=0)


def driver_information(path):
    """Of 4 GB, it says; the address of where it says so is the superblock's fourth."""
    electrodes(path, shape=(60, 19), dtype="f8")
    with open(path, "r+b") as file:
        end = file.seek(0, os.SEEK_END)
        file.write(struct.pack("<B3xI8s", 0, 2**32 - 17, b"NCSAfami") + bytes(64))
        file.seek(24 + 3 * 8)
        assert file.read(8) == b"\xff" * 8
        file.seek(24 + 3 * 8)
        file.write(struct.pack("<Q", end))


def endless_list(path, which: int = 0):
    """A heap, the first of the file being its root's, whose first free place names itself as the next."""
    if not path.exists():
        electrodes(path, data=np.zeros((60, 19)))
    with open(path, "r+b") as file:
        content = file.read()
        heap = [one.start() for one in re.finditer(b"HEAP", content)][which]
        _, first, address = struct.unpack_from("<3Q", content, heap + 8)
        address += content.index(b"\x89HDF")
        if first == 1:  # full: its first name is written over
            file.seek(heap + 16)
            file.write(struct.pack("<Q", 0))
            file.seek(address)
            file.write(struct.pack("<2Q", 8, 8))
            first = 8
        file.seek(address + first)
        file.write(struct.pack("<2Q", first, 8))


def endless_list_below(path):
    endless_list(path, -1)


def endless_list_of_names(path):
    """The names of a dataset's files, which the library loads as it opens the dataset."""
    external_storage(path)
    endless_list(path, -1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (endless_list, "memory allocation failed"), (endless_list_below, "memory allocation failed"),
        (endless_list_of_names, "memory allocation failed"), (driver_information, ""),
        (huge_shape, "GB in memory"), (huge_chunk, "chunks of 1450 MB"), (chunk_bomb, "unpacks to more than"),
        (external_storage, "other files"), (external_link, "a link to another file"), (virtual_storage, "other files"),
        (strange_filter, "HDF5 filter 6"),
    ],
)  # fmt: skip
@pytest.mark.parametrize(
    "load",
    [
        prepare, pairs_file.read_pairs, checksummed.read,
    ],
)  # fmt: skip
def test_hdf5(make, words, load, tmp_path):
    make(tmp_path / "a.h5")
    if make is huge_shape and load is not prepare:
        words = ""  # reported of its names first
    elif make is huge_shape:
        words = "0 stored bytes"
    refused(load, tmp_path / "a.h5", words)


def test_what_is_not_reached_is_not_read(tmp_path):
    """A terabyte of nothing after the data, which no one can look through."""
    electrodes(tmp_path / "a.h5", data=np.zeros((60, 19)))
    os.truncate(tmp_path / "a.h5", 2**40)
    with hdf5_checked.open_checked(tmp_path / "a.h5") as file:
        assert file["electrode_vals/data"].shape == (60, 19)


def test_a_chunk_for_each_number_takes_bounded_memory(tmp_path):
    values = np.random.default_rng(0).integers(3000, 3100, (9000, 19))
    electrodes(tmp_path / "a.h5", data=values, dtype="i2", chunks=(1, 1))
    assert report_of(recordings.read, tmp_path / "a.h5") == "read"
    np.testing.assert_array_equal(recordings.read(tmp_path / "a.h5").electrodes, values)
    electrodes(tmp_path / "b.h5", data=np.zeros((2, 30_000), "u1"), chunks=(1, 1))
    refused(recordings.read, tmp_path / "b.h5", "")


def test_groups_within_groups(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file
        for _ in range(3000):
            group = group.create_group("g")
    for load in (prepare, pairs_file.read_pairs, checksummed.read):
        refused(load, tmp_path / "a.h5", "deep")


SPOILED = {
    "change": [
        ({"shape": (8, 19), "external": [("/etc/passwd", 0, 1216)]}, "other files"),
        ({"shape": (8, 19), "chunks": (10**7, 19), "maxshape": (None, 19)}, "chunks of 1450 MB"),
        ({"shape": (8, 10**6)}, "change of shape"),
    ],
    "about": [({"shape": (10**12,), "chunks": (1000,)}, "stored bytes")],
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "options", "words"), [(name, *one) for name, several in SPOILED.items() for one in several]
)
def test_prepared_recordings_are_checked(name, options, words, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for column, kind in prepared_signals.COLUMNS.items():
            file[column] = np.zeros((8, 19) if column in ("change", "electrodes") else 8, kind)
        file["part"], file["rest"], file["about"] = np.zeros(1, int), np.zeros((1, 19)), np.zeros(2, np.uint8)
        del file[name]
        file.create_dataset(name, dtype=np.uint8 if name == "about" else float, **options)
    refused(rows_of, tmp_path / "a.h5", words)


def rows_of(path):
    prepared_signals.Prepared(path).read(np.arange(4))


def test_a_dataset_that_holds_nothing_is_bounded(tmp_path):
    many_frames_of_nothing(tmp_path / "a.h5")
    said = report_of(prepare, tmp_path / "a.h5")
    assert said.startswith("refused: "), said
    with h5py.File(tmp_path / "b.h5", "w") as file:
        nodes = ("biotac_nodes_sha256", "digit_nodes_sha256")
        words = dict.fromkeys((*pairs_file.ATTRIBUTES, *nodes), "x") | {"polarity": "falls", "electrodes": "sheet"}
        file.attrs.update(words, format=pairs_file.FORMAT)
        file.create_dataset("displacement_biotac", (10**6, 5000, 3), "i2", chunks=(1, 5000, 3))
        for name in set(pairs_file.DATASETS) - {"displacement_biotac"}:
            file[name] = np.zeros(1)
    refused(pairs_file.read_pairs, tmp_path / "b.h5", "stored bytes")


def test_the_bound_is_the_main_threads_alone_and_ends_with_it():
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_DATA)

    def within(_) -> tuple[int, int]:
        with hdf5_checked.bounded_memory(2**20):
            return resource.getrlimit(resource.RLIMIT_DATA)

    with ThreadPoolExecutor(2) as pool:  # as Dask's workers do tasks
        assert set(pool.map(within, range(8))) == {before}
    assert sys.platform != "linux" or within(0)[0] not in (before[0], resource.RLIM_INFINITY)
    assert resource.getrlimit(resource.RLIMIT_DATA) == before
