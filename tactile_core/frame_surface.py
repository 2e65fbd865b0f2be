"""The deformation of one frame, out of a converted or a simulated recording."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from . import sensors
from .errors import TactileError
from .frames_file import FORMAT as CONVERTED
from .recordings.simulated import FORMAT as SIMULATED
from .recordings.store import open_hdf5

if TYPE_CHECKING:
    from .recordings.store import Store


def frame_displacement(path: str | os.PathLike, sensor: str, frame: int) -> np.ndarray:
    """Displacement (n, 3) m of a sensor's surface nodes in a frame, by its number in the recording.

    Raises TactileError for a file that is neither ``frames.h5`` nor a simulated recording, one whose displacement was
    not kept or lies on another surface, and a frame that it does not hold.
    """
    path = os.fspath(path)
    if not os.path.isfile(path):
        raise TactileError(path, "there is no such file", "frames.h5 of `tactile convert`, or a simulated recording")
    with open_hdf5(path) as store:
        kind = store.attributes.get("format")
        if kind == CONVERTED:
            values, numbers, scale = _array(store, f"displacement_{sensor}", sensor), store.array("frame", (None,)), 1.0
        elif kind == SIMULATED:
            name = f"truth/displacement_{sensor}"
            values, scale = _array(store, name, sensor), store.attributes_of(name).get("scale", 1.0)
            numbers = np.arange(len(values))
        else:
            raise TactileError(path, f"format {kind!r}", f"{CONVERTED!r} or {SIMULATED!r}", "Name a file of `tactile`")
    check_numbers(path, numbers)
    row = np.flatnonzero(numbers == frame)
    if len(row) != 1 or len(numbers) != len(values):
        held = f"{numbers.min():g} to {numbers.max():g}" if len(numbers) else "none"
        raise TactileError(f"{path}, frame {frame}", "not in the file", f"a frame it holds ({held})")
    return values[row[0]].astype(np.float64) * scale


def check_numbers(path: str | os.PathLike, numbers: np.ndarray) -> None:
    """Raises TactileError for frame numbers (T,) that are no whole numbers from 0 on, each greater than the last."""
    whole = np.isfinite(numbers).all() and (numbers == np.floor(numbers)).all() and (numbers >= 0).all()
    if not (whole and (np.diff(numbers) > 0).all() and (numbers < 2**31).all()):
        found = f"frame numbers {np.array2string(numbers, threshold=6, edgeitems=3)}"
        raise TactileError(f"{os.fspath(path)}, frame", found, "whole ones from 0 on, each greater than the last")


def _array(store: Store, name: str, sensor: str) -> np.ndarray:
    if name not in store.shapes:
        advice = "Convert with --keep displacement" if name.startswith("displacement") else ""
        raise TactileError(f"{store.path}, {name}", "missing", "the deformation of each frame", advice)
    shape, count = store.shapes[name][0], len(sensors.sensor_surface(sensor).rest)
    if shape[1:] != (count, 3):
        raise TactileError(f"{store.path}, {name}", f"shape {shape}", f"(frames, {count}, 3)",
                           "It was made with another version of the surface: make it anew")  # fmt: skip
    return store.array(name, (None, count, 3), np.float32)
