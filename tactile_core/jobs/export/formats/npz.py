"""Write ``<recording>.npz``: all arrays of a recording, as NumPy reads them; labels as ``labels/<name>``."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..finished_job import Finished, Recorded

BRIEF = "one NPZ file a recording, all arrays"
TIME = (1980, 1, 1, 0, 0, 0)  # of the files inside: the same job gives the same bytes


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write a file for each recording."""
    done = 0
    for one in source.recordings:
        with zipfile.ZipFile(folder / f"{one.name}.npz", "w", zipfile.ZIP_STORED) as archive:
            for name, (shape, kind) in one.arrays().items():
                _write(archive, one, name, (one.frames, *shape), kind)
            for label, column in one.labels.items():
                with archive.open(zipfile.ZipInfo(f"labels/{label}.npy", TIME), "w") as out:
                    np.lib.format.write_array(out, column.astype(str), allow_pickle=False)
        done += one.frames
        progress(done, source.frames)


def _write(archive: zipfile.ZipFile, one: Recorded, name: str, shape: tuple[int, ...], kind: np.dtype) -> None:
    """Write the array `name` of any length: its header (shape, kind) first, then its rows, some at a time."""
    header = {"descr": np.lib.format.dtype_to_descr(kind), "fortran_order": False, "shape": shape}
    with archive.open(zipfile.ZipInfo(f"{one.stored(name)}.npy", TIME), "w", force_zip64=True) as out:
        np.lib.format.write_array_header_2_0(out, header)
        for block in one.blocks(without=one.arrays().keys() - {name}):
            out.write(np.ascontiguousarray(block[name]).tobytes())
