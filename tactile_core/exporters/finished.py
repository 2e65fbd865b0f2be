"""The shards of a finished job as recordings, some frames in memory at a time."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .. import sealed
from ..batch import job as jobs
from ..batch import manifest, shard
from ..batch.prepared import Prepared
from ..batch.recipes import Translate
from ..errors import TactileError

BLOCK = 32  # frames in memory at a time: 7 MB of pictures, 10 MB of heights


@dataclasses.dataclass(frozen=True)
class Recorded:
    """One recording. name : of it in the job; frames : of it; shards : its files, in order."""

    name: str
    frames: int
    shards: tuple[Path, ...]

    def blocks(self) -> Iterator[dict[str, np.ndarray]]:
        """All arrays of some frames after another, by the names of ``frames_file``."""
        import h5py

        for path in self.shards:
            with h5py.File(path, "r") as file:
                for start in range(0, len(file["frame"]), BLOCK):
                    yield {name: data[start : start + BLOCK] for name, data in file.items()}

    def arrays(self) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
        """Name -> shape of one frame, and type."""
        import h5py

        with h5py.File(self.shards[0], "r") as file:
            return {name: (tuple(data.shape[1:]), data.dtype) for name, data in file.items()}


@dataclasses.dataclass(frozen=True)
class Finished:
    """A job whose shards are all there. id : of the job"""

    id: str
    recordings: tuple[Recorded, ...]

    @property
    def frames(self) -> int:
        """Of all recordings."""
        return sum(one.frames for one in self.recordings)


def load(folder: Path) -> Finished:
    """The job of a folder. Raises TactileError where a shard is missing or not as it was written."""
    job = jobs.read(folder)
    if not isinstance(job.recipe, Translate):
        raise TactileError(folder, "a job of another verb", "one of `tactile batch`", "Give the verb's command again")
    status = manifest.status(folder, job)
    unread = [one for one in job.inputs if one.name in status.aside]
    if status.there < status.shards or status.prepared + len(unread) < status.recordings or not status.there:
        found, advice = f"{status.there} of {status.shards} shards", "Finish it: tactile batch --out DIR"
        raise TactileError(folder, found, "a finished job", advice)
    recordings = []
    for one in job.inputs:
        file = jobs.prepared_file(folder, one.name)
        if not file.exists():
            continue
        frames = len(Prepared(file))
        paths = tuple(jobs.shard_file(folder, one.name, number) for number in range(shard.count(frames, job)))
        for path in paths:
            if sealed.digest_of(path) is None:
                raise TactileError(path, "damaged", "a whole shard", "Make it anew: tactile batch --out DIR")
        recordings.append(Recorded(one.name, frames, paths))
    return Finished(job.id, tuple(recordings))
