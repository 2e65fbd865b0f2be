"""Read recordings, here or, if HDF5 does not work in Blender's own process, in another one.

Blenders of Linux distributions are linked against the system's HDF5, whose functions then take the place of those that
h5py's wheel brings: importing it fails (measured: Debian's 4.3.2). A plain Python process is free of that.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import os

import numpy as np

from ...tactile_core import recordings
from ...tactile_core.files.hdf5_checked import SIGNATURE
from ...tactile_core.recordings import Recording, Truth
from ...tactile_core.recordings.tables import column_map
from ...tactile_core.sensors import SOURCE
from .jobs import Job, JobFolder


def read(path: str | os.PathLike, sensor: str = SOURCE, columns: str = "") -> Recording:
    """Read a recording of ``sensor`` by ``recordings.read``; raises TactileError.
    columns : file that says what the recording's columns are, "" for none"""
    if _is_hdf5(path) and not _hdf5_works():
        return _read_elsewhere(os.fspath(path), sensor, columns)
    return recordings.read(path, column_map.read(columns) if columns else None, sensor)


def _is_hdf5(path: str | os.PathLike) -> bool:
    try:
        with open(path, "rb") as file:
            return file.read(len(SIGNATURE)) == SIGNATURE
    except OSError:
        return False  # the reader says what is wrong


@functools.cache
def _hdf5_works() -> bool:
    """Return false if importing h5py fails; true if it works, or if h5py is missing, which the reader will report."""
    try:
        import h5py  # noqa: F401
    except ModuleNotFoundError:
        return True
    except Exception:  # whatever a library of another version does to it
        return False
    return True


def _read_elsewhere(path: str, sensor: str = SOURCE, columns: str = "") -> Recording:
    """Read a recording in another process; raises TactileError with the reader's message."""
    with JobFolder() as folder:
        Job("read", folder, path=path, sensor=sensor, columns=columns).wait()
        about = json.loads((folder / "about.json").read_text(encoding="utf-8"))
        with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
            arrays = dict(stored)
    names = [field.name for field in dataclasses.fields(Truth) if field.name not in ("displacement", "traction")]
    truth = None
    if "truth.force" in arrays:
        truth = Truth(*(arrays.pop(f"truth.{name}", None) for name in names))
    about["warnings"] = tuple(about["warnings"])
    return Recording(**about, **arrays, truth=truth)
