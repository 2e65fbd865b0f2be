"""Read the shards of a finished job as recordings, some frames at a time."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import TactileError
from ...files import checksummed
from ...files.hdf5_checked import declared, open_checked
from ...files.outside import damage_reported
from ...recordings.labels import unfold
from ...sensors import PAIR
from .. import translate_shards
from ..engine import job as jobs
from ..engine import manifest
from ..engine.job import Translate
from ..frames_file import arrays_of, kept, named
from ..prepared_signals import Prepared

if TYPE_CHECKING:
    from ..engine.job import Job

ADVICE = "Make it again: remove the file, then tactile batch --out DIR"
BLOCK = 32  # frames in memory at a time: 7 MB of pictures, 10 MB of heights


def _kinds(path: Path) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
    """Return name -> (shape of one frame, type) of the arrays in a shard."""
    import h5py

    with h5py.File(path, "r") as file:
        return {name: (tuple(data.shape[1:]), data.dtype) for name, data in file.items()}


@dataclasses.dataclass(frozen=True)
class Recorded:
    """Recording of a finished job. name : in the job; frames : number of translated ones; shards : its files, in order
    labels : name -> (T,) object array of str; split : "train" or "test"; every : one frame in ``every`` was translated
    pair : names of sensor and gel, after which some arrays are named"""

    name: str
    frames: int
    shards: tuple[Path, ...]
    labels: dict[str, np.ndarray]
    split: str = "train"
    every: int = 1
    pair: tuple[str, str] = PAIR

    def blocks(self, without: Collection[str] = ()) -> Iterator[dict[str, np.ndarray]]:
        """Yield some frames at a time: array's name -> (n, ...), called after biotac and digit for any sensors.
        without : names of arrays to leave out"""
        import h5py

        for path in self.shards:
            with h5py.File(path, "r") as file:
                for start in range(0, len(file["frame"]), BLOCK):
                    held = {self._plain(name): data for name, data in file.items()}
                    yield {name: data[start : start + BLOCK] for name, data in held.items() if name not in without}

    def picture(self, frame: int) -> np.ndarray:
        """Return the picture (H, W, 3) uint8 of a translated frame, counted from 0; the job must have kept pictures."""
        import h5py

        for path in self.shards:
            with h5py.File(path, "r") as file:
                if frame < len(file["image"]):
                    return file["image"][frame]
                frame -= len(file["image"])
        raise IndexError(frame)

    def arrays(self) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
        """Return name -> (shape, dtype) of one frame's arrays, called after biotac and digit for any sensors."""
        return {self._plain(name): kind for name, kind in _kinds(self.shards[0]).items()}

    def stored(self, name: str) -> str:
        """Return the name in the shards, after this pair's sensors, of an array called after biotac or digit."""
        return named(name, self.pair)

    def _plain(self, name: str) -> str:
        for role, sensor in zip(PAIR, self.pair, strict=True):
            if name.endswith(f"_{sensor}"):
                return name.removesuffix(sensor) + role
        return name


@dataclasses.dataclass(frozen=True)
class Finished:
    """A finished job. aside : recording or shard -> why it is missing; warnings : recording -> sentences"""

    folder: Path
    id: str
    recordings: tuple[Recorded, ...]
    aside: dict[str, str]
    warnings: dict[str, list[str]]

    @property
    def frames(self) -> int:
        """Return the number of translated frames of all recordings."""
        return sum(one.frames for one in self.recordings)

    def check_kept(self, array: str, word: str) -> None:
        """Raise TactileError if the job did not keep an array, which `word` of ``--keep`` keeps."""
        if array not in self.recordings[0].arrays():
            advice = f"Make the job with --keep {word}"
            raise TactileError(self.folder, f"holds no {array}", f"a job that kept {word}", advice)


def load(folder: Path) -> Finished:
    """Return the finished job in a folder. Raises TactileError if a shard is missing, damaged or not the job's."""
    job = jobs.read(folder)
    if not isinstance(job.recipe, Translate):
        raise TactileError(folder, "a job of another verb", "one of `tactile batch`", "Give the verb's command again")
    status = manifest.status(folder, job)
    unread = [one for one in job.inputs if one.name in status.aside]
    if status.there < status.shards or status.prepared + len(unread) < status.recordings or not status.there:
        found = f"{status.there} of {status.shards} shards"
        advice = f"Finish it by tactile batch --out DIR: {jobs.completion(job)}"
        raise TactileError(folder, found, "a finished job", advice)
    recordings = []
    for index, one in enumerate(job.inputs):
        file = jobs.prepared_file(folder, one.name)
        if not file.exists():
            continue
        about = Prepared(file).about()
        frames = about["frames"]
        count = translate_shards.count(frames, job)
        paths = tuple(jobs.shard_file(folder, one.name, number) for number in range(count))
        for number, path in enumerate(paths):
            _check(path, job, index, number, frames)
        every, labels = job.recipe.every, unfold(about.get("labels", {}))
        labels = {name: texts[::every] for name, texts in labels.items()}
        done = translate_shards.translated(frames, job)
        pair = job.recipe.source, job.recipe.target
        recordings.append(Recorded(one.name, done, paths, labels, every=every, pair=pair))
    _check_alike([path for one in recordings for path in one.shards])
    return Finished(folder, job.id, tuple(recordings), status.aside, manifest.warnings(folder))


def _check(path: Path, job: Job[Translate], index: int, number: int, frames: int) -> None:
    """Raise TactileError for a shard that is damaged or another job's, or has other arrays or rows than it says."""
    if checksummed.verified_checksum(path) is None:
        raise TactileError(path, "damaged", "a whole shard", ADVICE)
    rows = min(job.recipe.shard_frames, translate_shards.translated(frames, job) - number * job.recipe.shard_frames)
    pair = job.recipe.source, job.recipe.target
    expected = {named(name, pair) for name in arrays_of(kept(job.recipe.keep, job.recipe.answer), shard=True)}
    with damage_reported(str(path), "shard"), open_checked(path) as file:
        if not translate_shards.is_of(path, job, index, number, frames):
            expected_shard = f"shard {number} of {job.inputs[index].name}"
            raise TactileError(path, "another shard under this name", expected_shard, ADVICE)
        lacking = {named("latent_digit", pair), "contact_normal"}  # a solved gel has no code, an older job no normal
        if not expected - lacking <= set(file) <= expected:
            raise TactileError(path, f"arrays {', '.join(sorted(file))}", ", ".join(sorted(expected)), ADVICE)
        for name, data in file.items():
            declared(data, f"{path}, {name}")
            if data.shape[:1] != (rows,) or data.dtype.kind not in "fiub":
                found = f"shape {data.shape} of {data.dtype}"
                raise TactileError(f"{path}, {name}", found, f"numbers of {rows} frames", ADVICE)


def _check_alike(paths: list[Path]) -> None:
    """Raise TactileError if shards hold other arrays than the first, or an array's frames differ in shape or type."""
    first: dict[str, str] = {}
    for path in paths:
        kinds = {name: f"frames are {kind.name} of shape {shape}" for name, (shape, kind) in _kinds(path).items()}
        first = first or kinds
        if apart := kinds.items() ^ first.items():
            name = min(apart)[0]
            found, expected = (each.get(name, "absent") for each in (kinds, first))
            raise TactileError(f"{path}, {name}", found, f"{expected}, as in {paths[0]}", ADVICE)
