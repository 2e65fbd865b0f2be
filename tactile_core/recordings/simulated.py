"""The project's own simulated recording: one HDF5 file that says that it is simulated and carries its truth.

Root attributes: ``format`` = "tactile-recording-1", ``simulated`` = True, ``sensor``, ``scene`` (TOML text), ``seed``,
``made_by``, ``note``, ``start_time`` (unix s, 0 if unknown). Datasets, T first: ``time`` (T,) float64 s; ``electrodes``
(T, 19), ``pdc``, ``tac``, ``tdc`` (T,) int16 raw 12-bit counts; ``truth/displacement_biotac`` (T, N, 3) and
``truth/displacement_digit`` (T, M, 3) int16 with attribute ``scale`` (m a unit); ``truth/force`` (T, 3) float32 N;
``truth/contact_center`` (T, 2) float32 m. The same arrays give the same bytes.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import atomic
from ..errors import TactileError
from .assemble import assemble
from .recording import ELECTRODES, Recording, Truth
from .store import Store

if TYPE_CHECKING:
    import h5py

FORMAT = "tactile-recording-1"
SCALE = 5e-7  # m a unit of the truth's int16: steps of 0.5 um (0.14 um rms, below any error measured), reach +-16 mm
COUNTS = (0, 4095)  # 12-bit readings
BLOCK = 16  # frames a chunk of the truth: a chunk stays below 300 kB at 2,700 nodes


def write_simulated(
    path: str | os.PathLike[str],
    *,
    time: np.ndarray,
    electrodes: np.ndarray,
    pdc: np.ndarray,
    tac: np.ndarray,
    tdc: np.ndarray,
    truth: Truth,
    scene: str,
    seed: int,
    made_by: str,
    note: str,
    sensor: str = "BioTac",
    start_time: float = 0.0,
) -> Path:
    """Write the file whole or not at all, and return its path. Shapes and units: see the module.

    Raises TactileError: shapes that do not belong together, counts outside 12 bits, displacements beyond +-16 mm.
    """
    path = Path(path)
    frames = len(time)
    _check_shape(path, "time", time, (frames,))
    counts = {"electrodes": _counts(path, "electrodes", electrodes, (frames, ELECTRODES))}
    counts |= {
        name: _counts(path, name, value, (frames,)) for name, value in (("pdc", pdc), ("tac", tac), ("tdc", tdc))
    }
    _check_shape(path, "truth/force", truth.force, (frames, 3))
    _check_shape(path, "truth/contact_center", truth.contact_center, (frames, 2))
    steps = {
        name: _steps(path, name, getattr(truth, name), frames) for name in ("displacement_biotac", "displacement_digit")
    }
    attributes = {
        "format": FORMAT,
        "simulated": True,
        "sensor": sensor,
        "scene": scene,
        "seed": int(seed),
        "made_by": made_by,
        "note": note,
        "start_time": float(start_time),
    }
    plain = {"time": np.asarray(time, np.float64)} | counts
    forces = {f"truth/{name}": np.asarray(getattr(truth, name), np.float32) for name in ("force", "contact_center")}
    _write_whole(path, lambda file: _fill(file, attributes, plain, steps, forces))
    return path


def _fill(
    file: h5py.File,
    attributes: dict[str, Any],
    plain: dict[str, np.ndarray],
    steps: dict[str, np.ndarray],
    forces: dict[str, np.ndarray],
) -> None:
    """The datasets of a file, always in this order, so that the same arrays give the same bytes."""
    for key, value in attributes.items():
        file.attrs[key] = value
    packed = {"compression": "gzip", "compression_opts": 6, "shuffle": True, "track_times": False}
    for name, value in plain.items():
        file.create_dataset(name, data=value, **packed)
    for name, value in steps.items():
        chunks = (min(BLOCK, len(value)), *value.shape[1:])
        data = file.create_dataset(f"truth/{name}", data=value, chunks=chunks, **packed)
        data.attrs["scale"] = SCALE
    for name, value in forces.items():
        file.create_dataset(name, data=value, **packed)


def read_simulated(store: Store, layout: str) -> Recording:
    """The Recording of an opened file of this format, with its truth as float32 in m."""
    electrodes = store.array("electrodes", (None, ELECTRODES))
    frames = len(electrodes)
    about = {key: store.attributes.get(key, "") for key in ("sensor", "scene", "seed", "made_by", "note")}
    truth = Truth(
        _displacement(store, "truth/displacement_biotac", frames),
        _displacement(store, "truth/displacement_digit", frames),
        store.array("truth/force", (frames, 3)),
        store.array("truth/contact_center", (frames, 2)),
    )
    start = store.attributes.get("start_time", 0.0)
    start = float(start) if isinstance(start, int | float) and np.isfinite(start) else 0.0
    columns = {name: store.optional(name, (frames,)) for name in ("pdc", "tac", "tdc")}
    return assemble(
        store.path,
        layout,
        electrodes=electrodes,
        stamps=store.array("time", (frames,)) + start,
        truth=truth,
        simulated=True,
        about=about,
        **columns,
    )


def _displacement(store: Store, name: str, frames: int) -> np.ndarray:
    nodes = store.shapes[name][0][1:2] if name in store.shapes else (None,)
    steps = store.array(name, (frames, *nodes, 3), np.float32)
    scale = store.attributes_of(name).get("scale")
    if not isinstance(scale, float) or not 0 < scale < 1:
        raise TactileError(f"{store.path}, {name}", f"attribute scale = {scale!r}", "metres a unit, such as 1e-7")
    return steps * np.float32(scale)


def _check_shape(path: Path, name: str, value: np.ndarray, shape: tuple[int, ...]) -> None:
    if np.shape(value) != shape:
        raise TactileError(f"{path}, {name}", f"shape {np.shape(value)}", str(shape))


def _counts(path: Path, name: str, value: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    _check_shape(path, name, value, shape)
    rounded = np.rint(np.asarray(value, float))
    if not np.all((rounded >= COUNTS[0]) & (rounded <= COUNTS[1])):  # false for NaN too
        raise TactileError(
            f"{path}, {name}", "values outside 12 bits", f"counts {COUNTS[0]}..{COUNTS[1]}", "Clip as the sensor does"
        )
    return rounded.astype(np.int16)


def _steps(path: Path, name: str, value: np.ndarray, frames: int) -> np.ndarray:
    if np.ndim(value) != 3 or np.shape(value)[0] != frames or np.shape(value)[2] != 3:
        raise TactileError(f"{path}, truth/{name}", f"shape {np.shape(value)}", f"({frames}, nodes, 3)")
    steps = np.rint(np.asarray(value, np.float64) / SCALE)
    if not np.all(np.abs(steps) <= np.iinfo(np.int16).max):
        raise TactileError(f"{path}, truth/{name}", "displacements beyond +-16 mm or not finite", "at most 16 mm")
    return steps.astype(np.int16)


def _write_whole(path: Path, fill: Any) -> None:
    """Let fill write a file that appears whole or not at all.

    It is made in memory: HDF5 keeps a file open whose writing failed on a full disk, and crashes at the process's end.
    """
    import h5py

    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        fill(file)
    try:
        atomic.write_bytes(path, memory.getvalue())
    except OSError as error:
        reason = error.strerror or str(error)
        raise TactileError(path, f"cannot be written ({reason})", "room in a folder that can be written to") from error
