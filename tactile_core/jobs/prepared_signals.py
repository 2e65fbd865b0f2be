"""Store a recording's signals, ready for the networks, in a checksummed file of which shards read a few rows.

Datasets, T first: ``time`` s; ``change`` from rest and ``electrodes`` as read (T, e) counts; ``quiet``, no contact;
``flags``; ``pdc`` counts, the fluid's pressure over rest. ``part`` (P,) first frame of each part of the recording,
``rest`` (P, e) counts. ``about``: JSON of the recording's reports. Chunks carry checksums: a damaged one is refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NotRequired, TypedDict

import msgspec
import numpy as np

from ..files import atomic, checksummed
from ..files.hdf5_checked import declared, open_checked
from ..files.hdf5_writer import new_hdf5
from ..files.outside import damage_reported
from ..recordings import Recording, Signals
from ..recordings.chunks import read_parts
from ..recordings.labels import Runs, extend
from ..recordings.preparer import Preparer
from ..recordings.recording import split
from ..sensors import SOURCE
from ..sensors.fluid_sensor import MOST_ELECTRODES
from .convert import check_order
from .engine import job as jobs
from .engine.inputs import check_unchanged

if TYPE_CHECKING:
    import h5py

    from .engine.job import Job, Translate

CHUNK = 1024  # rows per chunk: 160 kB of changes
COLUMNS = {
    "time": np.float64, "change": np.float64, "electrodes": np.float32, "quiet": bool, "flags": np.uint16,
    "pdc": np.float64,
}  # fmt: skip
Positive = Annotated[float, msgspec.Meta(gt=0)]
MAX_WARNINGS = 100  # kept of one recording, the rest are counted


class About(TypedDict):
    """Facts of a recording. prepared : ``Signals.report`` of each part; frames : their number; labels : of all frames
    start_time : unix s, 0 if unknown; film, stiffness : the unit's, divided by a typical unit's"""

    recording: str
    layout: str
    simulated: bool
    start_time: float
    kind: str
    warnings: list[str]
    prepared: list[dict[str, Any]]
    sha256: str
    frames: int
    sensor: NotRequired[str]
    film: NotRequired[Positive]
    stiffness: NotRequired[Positive]
    labels: NotRequired[Runs]


def make(folder: Path, job: Job[Translate], index: int) -> tuple[int, bool]:
    """Prepare recording `index` unless it is prepared; return its number of frames, and true if it was prepared now.
    Raises TactileError if the recording changed."""
    one = job.inputs[index]
    file = jobs.prepared_file(folder, one.name)
    _, frames = checksummed.stated(file)
    if frames is not None and checksummed.verified_checksum(file) is not None:
        return frames, False
    check_unchanged(one)
    with atomic.new_file(file, shared=True) as partial:
        with new_hdf5(partial, {}, checksummed.ROOM) as (out, _):
            writer = _Writer(out)
            for recording, signals, repeated in _signals(one.path, job):
                writer.append(recording, signals, repeated)
            writer.close(one.sha256)
        checksummed.write_checksum(partial, rows=writer.count)
    return writer.count, True


def _signals(path: str, job: Job[Translate]) -> Iterator[tuple[Recording, Signals, int]]:
    """Yield each part of a recording, its signals, and the number of its first frames that repeat the part before."""
    options, source = job.recipe.prepare.options(), job.recipe.source
    sensor = job.recipe.sensor
    unit = None if sensor is None else sensor.gains_for(path, split(path).section, "--sensor", source)

    def parts() -> Iterator[Recording]:
        return (part.recording for part in read_parts(path, options.columns, source))

    prepare = Preparer(options, unit, parts)
    for part in read_parts(path, options.columns, source):
        check_order(part.recording, job.recipe.answer)
        yield part.recording, prepare(part.recording), part.repeated


class _Writer:
    """Writer of the datasets of a prepared file, part by part."""

    def __init__(self, file: h5py.File) -> None:
        self.count, self._file = 0, file
        self._parts: list[tuple[int, np.ndarray]] = []
        self._about: dict[str, Any] = {"warnings": [], "prepared": [], "labels": {}}

    def append(self, recording: Recording, signals: Signals, repeated: int) -> None:
        """Add a part's new frames, those after the first `repeated`."""
        arrays = {"time": recording.time, **{name: getattr(signals, name) for name in tuple(COLUMNS)[1:]}}
        end = self.count + len(recording) - repeated
        for name, kind in COLUMNS.items():
            values = np.asarray(arrays[name])[repeated:].astype(kind)
            if name not in self._file:
                options = {"chunks": (CHUNK, *values.shape[1:]), "fletcher32": True, "track_times": False}
                shape = (0, *values.shape[1:])
                self._file.create_dataset(name, shape, kind, maxshape=(None, *shape[1:]), **options)
            data = self._file[name]
            data.resize(end, axis=0)
            data[self.count :] = values
            data.flush()  # where its chunks lie in the file is settled now, not by when Python lets go of it
        if not self._parts:
            self._about |= {
                "recording": recording.name, "layout": recording.layout, "simulated": recording.simulated,
                "start_time": recording.start_time, "kind": signals.kind,
                "sensor": recording.sensor, "film": signals.film, "stiffness": signals.stiffness,
            }  # fmt: skip
        self._parts.append((self.count, signals.rest))
        self._about["warnings"] += [text for text in signals.warnings if text not in self._about["warnings"]]
        self._about["prepared"].append(signals.report)
        labels = {name: column[repeated:] for name, column in recording.labels.items()}
        extend(self._about["labels"], labels, self.count, end)
        self.count = end

    def close(self, digest: str) -> None:
        """Write the facts that are known at the end alone. digest : SHA-256 of the recording"""
        warnings = self._about["warnings"]
        if len(warnings) > MAX_WARNINGS:
            warnings[MAX_WARNINGS:] = [f"{len(warnings) - MAX_WARNINGS} more warnings"]
        self._file["part"] = np.array([first for first, _ in self._parts], np.int64)
        self._file["rest"] = np.array([rest for _, rest in self._parts])
        # A name that is no UTF-8 holds lone surrogates, which ASCII escapes; frames.h5 replaces them as well.
        text = json.dumps(self._about | {"sha256": digest, "frames": self.count}, sort_keys=True)
        self._file.create_dataset("about", data=np.frombuffer(text.encode("ascii"), np.uint8), track_times=False)


class Prepared:
    """Reader of a prepared file, which each call opens anew. Raises TactileError if it is damaged."""

    def __init__(self, file: Path) -> None:
        self._path = file

    def __len__(self) -> int:
        return self._read(lambda file: len(file["time"]))

    def about(self) -> About:
        """Return the facts of the whole recording: layout, kind, warnings, number of frames and the like."""
        return self._read(lambda file: msgspec.convert(json.loads(file["about"][()].tobytes()), About))

    def read(self, frames: np.ndarray) -> tuple[np.ndarray, Signals]:
        """Return the times (n,) s and signals of rising frames (n,); ``rest`` is that of the first frame's part."""
        start, about = int(frames[0]), self.about()

        def read(file: h5py.File) -> tuple[np.ndarray, Signals]:
            arrays = {name: file[name][start : frames[-1] + 1][frames - start] for name in COLUMNS}
            rest = file["rest"][int(np.searchsorted(file["part"][()], start, side="right")) - 1]
            return arrays.pop("time"), Signals(
                rest=rest, drift=np.zeros_like(rest), kind=about["kind"], warnings=(), report={},
                sensor=about.get("sensor", SOURCE), film=about.get("film", 1.0),
                stiffness=about.get("stiffness", 1.0), **arrays,
            )  # fmt: skip

        return self._read(read)

    def _read(self, what: Any) -> Any:
        advice = "Run the job again, which makes it again"
        with damage_reported(self._path, "prepared recording", advice), open_checked(self._path) as file:
            _check(self._path, file)
            return what(file)


def _check(path: Path, file: h5py.File) -> None:
    """Raise ValueError or TactileError for arrays of other shapes or types, whose rows might take more memory."""
    count, electrodes = len(file["time"]), file["rest"].shape[1]
    if not 0 < electrodes <= MOST_ELECTRODES:
        raise ValueError(f"rest of {electrodes} electrodes")
    others = {"part": np.int64, "rest": np.float64, "about": np.uint8}
    for name, kind in (COLUMNS | others).items():
        data, shape = file[name], (count, electrodes) if name in ("change", "electrodes") else (count,)
        if data.dtype != kind or (name in COLUMNS and data.shape != shape):
            raise ValueError(f"{name} of shape {data.shape} and type {data.dtype}")
        if name in others:
            declared(data, f"{path}, {name}")
