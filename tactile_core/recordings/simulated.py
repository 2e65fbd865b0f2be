"""The project's own simulated recording: one HDF5 file that says that it is simulated and holds its true values.

Root attributes: ``format`` = "tactile-recording-1", ``simulated`` = True, ``sensor``, ``scene`` (TOML text), ``seed``,
``made_by``, ``note``, ``polarity`` ("falls"; older files without it have counts that rise), ``start_time`` (unix s, 0
if unknown).
Datasets, T first: ``time`` (T,) float64 s; ``electrodes`` (T, 19), ``pdc``, ``tac``, ``tdc`` (T,) int16 raw 12-bit
counts; ``truth/displacement_biotac`` (T, N, 3) and ``truth/displacement_digit`` (T, M, 3) int16 with attribute
``scale`` (m per unit); ``truth/force`` (T, 3) float32 N; ``truth/contact_center`` (T, 2) float32 m; where asked for
``truth/traction_biotac`` (T, N, 3) and ``truth/traction_digit`` (T, M, 3) float32 Pa; likewise those of further
sensors. The same arrays give the same bytes. `tactile simulate --keep` writes only some of them besides ``time`` and
``truth/force``; a file without ``electrodes`` is no recording to translate."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TactileError
from ..files import atomic
from ..files.hdf5_writer import new_hdf5
from ..sensors import COUNT_MAX, ELECTRODES, SOURCE, TARGET
from ..sensors.fluid_sensor import FALLS, RISES
from .array_store import Store, open_hdf5
from .assemble import assemble
from .recording import Recording, Truth

FORMAT = "tactile-recording-1"
SCALE = 5e-7  # m per unit of the truth's int16: steps of 0.5 um (0.14 um rms, below any error measured), reach +-16 mm
_MOVED, _PRESSED = "displacement_", "traction_"  # before a sensor's name
BLOCK = 16  # frames per chunk of the truth: a chunk stays below 300 kB at 2,700 nodes


def write_simulated(
    path: str | os.PathLike[str],
    *,
    time: np.ndarray,
    electrodes: np.ndarray | None = None,
    pdc: np.ndarray | None = None,
    tac: np.ndarray | None = None,
    tdc: np.ndarray | None = None,
    truth: Truth,
    scene: str,
    seed: int,
    made_by: str,
    note: str,
    start_time: float = 0.0,
) -> Path:
    """Write a simulated recording, whole or not at all, and return its path; arrays that are None are left out.
    time : (T,) s; electrodes : (T, 19) raw counts; pdc, tac, tdc : (T,) raw counts; start_time : unix s, 0 if unknown
    truth : true values, arrays of T frames; scene : the scene's TOML text; seed : random seed of the simulation
    made_by : name of the program; note : what a reader must know
    Raises TactileError for shapes that do not fit, counts outside 12 bits, and displacements beyond +-16 mm."""
    path, frames = Path(path), len(time)
    _check_shape(path, "time", time, (frames,))
    plain: dict[str, np.ndarray] = {"time": np.asarray(time, np.float64)}
    for name, value in {"electrodes": electrodes, "pdc": pdc, "tac": tac, "tdc": tdc}.items():
        if value is not None:
            plain[name] = _counts(path, name, value, (frames, ELECTRODES) if name == "electrodes" else (frames,))
    forces: dict[str, np.ndarray] = {}
    for name, value, width in (("force", truth.force, 3), ("contact_center", truth.contact_center, 2)):
        if value is not None:
            _check_shape(path, f"truth/{name}", value, (frames, width))
            forces[f"truth/{name}"] = np.asarray(value, np.float32)
    moved = {f"truth/{_MOVED}{sensor}": values for sensor, values in truth.displacements.items()}
    steps = {name: _steps(path, name, values, frames) for name, values in moved.items()}
    pressed = {f"truth/{_PRESSED}{sensor}": values for sensor, values in truth.tractions.items()}
    tractions = {name: _of_nodes(path, name, values, frames).astype(np.float32) for name, values in pressed.items()}
    attributes: dict[str, Any] = {
        "format": FORMAT, "simulated": True, "sensor": "BioTac", "scene": scene, "seed": int(seed), "made_by": made_by,
        "note": note, "polarity": FALLS, "start_time": float(start_time),
    }  # fmt: skip
    packed = {"compression": "gzip", "compression_opts": 6, "shuffle": True, "track_times": False}
    room = atomic.writing(path, "room in a folder that can be written to", "")
    with room, atomic.new_file(path) as partial, new_hdf5(partial, attributes) as (file, _):
        for name, values in plain.items():
            file.create_dataset(name, data=values, **packed)
        for name, values in steps.items():
            data = file.create_dataset(name, data=values, chunks=(min(BLOCK, frames), *values.shape[1:]), **packed)
            data.attrs["scale"] = SCALE
        for name, values in forces.items():
            file.create_dataset(name, data=values, **packed)
        for name, values in tractions.items():
            chunks = (min(BLOCK, frames), *values.shape[1:])
            file.create_dataset(name, data=values, chunks=chunks, **packed).attrs["unit"] = "Pa"
    return path


def read_simulated(store: Store, layout: str) -> Recording:
    """Return the recording in an open file; layout : in words. Raises TactileError if arrays are missing or misfit."""
    if "electrodes" not in store.shapes:
        expected = "readings, which a recording has"
        raise TactileError(f"{store.path}, electrodes", "missing", expected, "Simulate it with --keep electrodes")
    electrodes = store.array("electrodes", (None, ELECTRODES))
    frames = len(electrodes)
    about = {key: store.attributes.get(key, "") for key in ("sensor", "scene", "seed", "made_by", "note")}
    about["polarity"] = str(store.attributes.get("polarity", RISES))
    time, truth = _times(store, frames), _truth(store, frames)
    columns: dict[str, Any] = {name: store.optional(name, (frames,)) for name in ("pdc", "tac", "tdc")}
    return assemble(
        store.path, layout, electrodes=electrodes, stamps=time, truth=truth, simulated=True, about=about, **columns
    )


def read_truth(path: str | os.PathLike) -> tuple[np.ndarray, Truth]:
    """Return times (T,), unix s, or s from the start if the file states none, and the true values of a simulated
    recording, with electrodes or without. Raises TactileError for another file."""
    with open_hdf5(os.fspath(path)) as store:
        if store.attributes.get("format") != FORMAT:
            raise TactileError(path, f"format {store.attributes.get('format')!r}", repr(FORMAT))
        frames = len(store.array("time", (None,)))
        return _times(store, frames), _truth(store, frames)


def _times(store: Store, frames: int) -> np.ndarray:
    start = store.attributes.get("start_time", 0.0)
    start = float(start) if isinstance(start, int | float) and np.isfinite(start) else 0.0
    return store.array("time", (frames,)) + start


def _truth(store: Store, frames: int) -> Truth:
    moved, pressed = (
        {name.removeprefix(f"truth/{kind}"): read(store, name, frames)
         for name in sorted(store.shapes) if name.startswith(f"truth/{kind}")}
        for kind, read in ((_MOVED, _displacement), (_PRESSED, _traction))
    )  # fmt: skip
    return Truth(
        moved.pop(SOURCE, None),
        moved.pop(TARGET, None),
        store.array("truth/force", (frames, 3)),
        store.optional("truth/contact_center", (frames, 2)),
        pressed.pop(SOURCE, None),
        pressed.pop(TARGET, None),
        moved,
        pressed,
    )


def _traction(store: Store, name: str, frames: int) -> np.ndarray:
    return store.array(name, (frames, *store.shapes[name][0][1:2], 3), np.float32)


def _displacement(store: Store, name: str, frames: int) -> np.ndarray:
    steps = _traction(store, name, frames)
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
    if not np.all((rounded >= 0) & (rounded <= COUNT_MAX)):  # false for NaN too
        advice = "Clip as the sensor does"
        raise TactileError(f"{path}, {name}", "values outside 12 bits", f"counts 0..{COUNT_MAX}", advice)
    return rounded.astype(np.int16)


def _of_nodes(path: Path, name: str, value: np.ndarray, frames: int) -> np.ndarray:
    if np.ndim(value) != 3 or np.shape(value)[0] != frames or np.shape(value)[2] != 3:
        raise TactileError(f"{path}, {name}", f"shape {np.shape(value)}", f"({frames}, nodes, 3)")
    return np.asarray(value)


def _steps(path: Path, name: str, value: np.ndarray, frames: int) -> np.ndarray:
    steps = np.rint(np.asarray(_of_nodes(path, name, value, frames), np.float64) / SCALE)
    if not np.all(np.abs(steps) <= np.iinfo(np.int16).max):
        raise TactileError(f"{path}, {name}", "displacements beyond +-16 mm or not finite", "at most 16 mm")
    return steps.astype(np.int16)
