"""The reverse direction: from a gel's deformation to the BioTac's skin, its force, and its electrodes' counts."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from ..errors import TactileError
from ..files import atomic
from ..files.hdf5_writer import new_hdf5
from ..translation.translate import CHUNK
from ..translation.translator import Translator
from .gel_frames import read_displacement
from .results import select

FORMAT = "tactile-reverse-1"
# dataset -> (unit, meaning); T is the number of frames
ARRAYS = {
    "frame": ("1", "index of the frame in the input"),
    "displacement": ("m", "(T, N, 3) of the skin's nodes, attribute sensor: whose"),
    "force": ("N", "(T, 3) of the object on the sensor; 0 where the gel is at rest"),
    "electrodes": ("count", "(T, e) changes against rest, as raw readings have them"),
}


def reverse(
    path: str | os.PathLike,
    out: str | os.PathLike,
    translator: Translator,
    frames: slice = slice(None),
    progress: Callable[[int, int], None] = lambda done, total: None,
    *,
    overwrite: bool = False,
) -> None:
    """Translate the gel of frames.h5, or of a simulated recording, back into a new HDF5 file of ``ARRAYS``.
    translator : its networks lead from the skin to that gel; frames : slice of the input's; overwrite : true replaces
     `out`; progress : called with (frames done, frames in all)
    Raises TactileError for an input without that gel's displacement, and an output that exists or cannot be written."""
    if os.path.lexists(out) and not overwrite:
        raise TactileError(out, "exists", "a new file", "Add --overwrite, or another --out")
    held = read_displacement(path, translator.target)
    rows = select(frames, len(held.numbers))
    writable = atomic.writing(out, "a file in a writable folder", "Name another --out")
    about = {"format": FORMAT, "sensor": translator.source, "weights": translator.sha256}
    with writable, atomic.new_file(out) as unfinished, new_hdf5(unfinished, about) as (file, disk):
        for start in range(0, len(rows), CHUNK):
            some = rows[start : start + CHUNK]
            gel = np.stack(list(held.iterate_rows(some))).astype(np.float32)
            arrays = {"frame": held.numbers[some].astype(np.int32), **translator.reverse(gel)}
            for name, values in arrays.items():
                if start == 0:
                    data = file.create_dataset(name, (len(rows), *values.shape[1:]), values.dtype, track_times=False)
                    data.attrs.update(dict(zip(("unit", "description"), ARRAYS[name], strict=True)))
                file[name][start : start + len(some)] = values
            disk.check()
            progress(start + len(some), len(rows))
