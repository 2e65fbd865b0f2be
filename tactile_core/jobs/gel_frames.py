"""Read inputs of rendering, frames of a recording, height maps or a scene, as displacements or height maps."""

from __future__ import annotations

import dataclasses
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..files import outside
from ..files.exr_file import read_height
from ..files.hdf5_checked import SIGNATURE
from ..recordings.array_store import Store, open_hdf5, open_npz
from ..recordings.simulated import FORMAT as SIMULATED
from ..sensors import TARGET
from .frames_file import FORMAT as CONVERTED

CONVERT = "Of a recording: `tactile convert` it first, and render its frames.h5"
EXPECTED = "frames.h5, a simulated recording (.h5), a height map (.npz, .exr), or a scene's folder"
HEIGHT_ARRAY = "height_map"
HEIGHTS = "height map"  # the kind of an input of them, in words

Progress = Callable[[], AbstractContextManager[Callable[[int, int], None]]]


@dataclasses.dataclass(frozen=True)
class Frames:
    """Frames of an input: displacements of a gel's nodes, or height maps, the other being None.
    kind : the input's, in words; numbers : (T,) int, numbers of the frames
    displacement : (T, M, 3) m of M nodes, after multiplication by scale; heights : (T, H, W) m"""

    kind: str
    numbers: np.ndarray
    displacement: np.ndarray | None = None
    scale: float = 1.0
    heights: np.ndarray | None = None

    def iterate_rows(self, rows: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the displacement (M, 3) m or heights (H, W) m of each of rows (n,), indices into ``numbers``."""
        if self.heights is not None:
            yield from self.heights[rows]
        elif self.displacement is not None:
            yield from (self.displacement[row] * self.scale for row in rows)


def read_frames(
    path: str | os.PathLike, progress: Progress = lambda: nullcontext(lambda done, total: None), gel: str = TARGET
) -> Frames:
    """Return the frames of a file, or of a scene's folder, which is simulated. gel : name of the sensor to read or
    simulate; progress : function to a context of a callback (done, in all) for a simulation
    Raises TactileError for anything else, and for an unreadable file."""
    path = Path(path)
    if path.is_dir() or path.suffix == ".toml":  # a scene, which is simulated first
        return _of_scene(path, progress, gel)
    if not path.is_file():
        raise TactileError(path, "there is no such file", EXPECTED)
    if path.suffix == ".npz":
        return _of_npz(path)
    if path.suffix == ".exr":
        return Frames(HEIGHTS, np.zeros(1, int), heights=read_height(path)[None])
    return read_displacement(path, gel)


def read_displacement(path: str | os.PathLike, gel: str = TARGET) -> Frames:
    """Return the frames of a sensor's surface, `gel`, in ``frames.h5`` or a simulated recording. Raises TactileError
    for other files, and if the displacement was not kept."""
    if not os.path.isfile(path):
        found = "a folder" if os.path.isdir(path) else "there is no such file"
        raise TactileError(path, found, "frames.h5, or a simulated recording (.h5)")
    with open(path, "rb") as file:  # the project's own files for this have no user block
        if file.read(len(SIGNATURE)) != SIGNATURE:
            raise TactileError(path, "no HDF5 file", EXPECTED, CONVERT)
    with open_hdf5(os.fspath(path)) as store:
        kind = store.attributes.get("format")
        if kind == CONVERTED:
            name, numbers = f"displacement_{gel}", store.array("frame", (None,))
            check_numbers(path, numbers)
            numbers = numbers.astype(int)
        elif kind == SIMULATED:
            name, numbers = f"truth/displacement_{gel}", None
        else:
            raise TactileError(path, f"format {kind!r}" if kind else "no frames of ours", EXPECTED, CONVERT)
        displacement = _array(store, name, gel)
        scale = float(store.attributes_of(name).get("scale", 1.0))
    numbers = np.arange(len(displacement)) if numbers is None else numbers
    if len(numbers) != len(displacement) or not len(numbers):
        raise TactileError(path, f"{len(displacement)} frames of {len(numbers)} numbers", "as many, one or more")
    return Frames("converted" if kind == CONVERTED else "simulated", numbers, displacement, scale)


def _of_npz(path: Path) -> Frames:
    with outside.open_file(path, "an NPZ file") as file, open_npz(os.fspath(path), file) as store:
        names = list(store.shapes)
        if "electrodes" in names:
            raise TactileError(path, "a recording's electrodes", EXPECTED, CONVERT)
        if HEIGHT_ARRAY not in names and len(names) != 1:
            expected = f"one called {HEIGHT_ARRAY}, or one in all"
            raise TactileError(path, f"arrays {', '.join(names) or 'none'}", expected)
        name = HEIGHT_ARRAY if HEIGHT_ARRAY in names else names[0]
        shape = store.shapes[name][0]
        if len(shape) not in (2, 3) or 0 in shape:
            raise TactileError(f"{path}, {name}", f"shape {shape}", "heights (H, W) or (T, H, W), m")
        heights = store.array(name, (None,) * len(shape), np.float32).reshape(-1, *shape[-2:])
    return Frames(HEIGHTS, np.arange(len(heights)), heights=heights)


def _of_scene(path: Path, progress: Progress, gel: str) -> Frames:
    from ..simulation.scene_recording import simulate_recording

    with tempfile.TemporaryDirectory() as folder, progress() as shown:
        simulated = Path(folder) / "scene.h5"
        simulate_recording(path, simulated, progress=shown, keep=(f"displacement_{gel}",))
        return dataclasses.replace(read_displacement(simulated, gel), kind="scene")


def frame_displacement(path: str | os.PathLike, sensor: str, frame: int) -> np.ndarray:
    """Return the displacement (n, 3) m of a sensor's surface nodes in a frame, by its number in the recording. Raises
    TactileError for a file that is neither ``frames.h5`` nor a simulated recording, a displacement that was not kept or
    is another surface's, and a missing frame."""
    held = read_displacement(path, sensor)
    row = np.flatnonzero(held.numbers == frame)
    if held.displacement is None or len(row) != 1:
        span = f"{held.numbers.min():g} to {held.numbers.max():g}"
        raise TactileError(f"{os.fspath(path)}, frame {frame}", "not in the file", f"a frame it holds ({span})")
    return held.displacement[row[0]].astype(np.float64) * held.scale


def check_numbers(path: str | os.PathLike, numbers: np.ndarray) -> None:
    """Raise TactileError unless frame numbers (T,) are rising whole numbers from 0 on."""
    whole = np.isfinite(numbers).all() and (numbers == np.floor(numbers)).all() and (numbers >= 0).all()
    if not (whole and (np.diff(numbers) > 0).all() and (numbers < 2**31).all()):
        found = f"frame numbers {np.array2string(numbers, threshold=6, edgeitems=3)}"
        raise TactileError(f"{os.fspath(path)}, frame", found, "whole ones from 0 on, each greater than the last")


def _array(store: Store, name: str, sensor: str) -> np.ndarray:
    if name not in store.shapes:
        converted = name.startswith("displacement")
        advice = "Convert with --keep displacement" if converted else f"Simulate with --keep displacement_{sensor}"
        raise TactileError(f"{store.path}, {name}", "missing", "the deformation of each frame", advice)
    shape, count = store.shapes[name][0], len(sensors.sensor_surface(sensor).rest)
    if shape[1:] != (count, 3):
        raise TactileError(f"{store.path}, {name}", f"shape {shape}", f"(frames, {count}, 3)",
                           "It was made with another version of the surface: make it again")  # fmt: skip
    return store.array(name, (None, count, 3), np.float32)
