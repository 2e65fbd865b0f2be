"""Find the state of a job from its folder's files alone, and write its manifest."""

from __future__ import annotations

import dataclasses
import errno
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from ...errors import TactileError
from ...files import atomic, checksummed
from ...files.outside import read_small
from . import job as jobs
from .job import Job

FORMAT = "tactile-batch-1"


@dataclasses.dataclass
class Status:
    """Progress of a job.
    recordings, prepared : number of recordings, and of those that are prepared; frames : in the prepared ones
    shards, there : number of shards of the prepared ones, and of shards that exist
    bytes : of their shards, estimated, 0 if unknown; aside : task -> why it could not be done"""

    recordings: int
    prepared: int = 0
    shards: int = 0
    there: int = 0
    frames: int = 0
    bytes: int = 0
    aside: dict[str, str] = dataclasses.field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Return true if nothing is missing."""
        return self.prepared == self.recordings and self.there == self.shards


def status(folder: Path, job: Job) -> Status:
    """Return the progress of a job, by the names and lengths of its files; their content is not checked."""
    found = Status(len(job.inputs), aside=_aside(folder))
    there = {path.name for path in (folder / jobs.SHARDS).glob("*.h5")}
    for index, one in enumerate(job.inputs):
        seen = jobs.module_for(job.recipe).inspect_input(folder, job, index)
        if seen is None:
            continue
        names = [jobs.shard_file(folder, one.name, number).name for number in range(seen.shards)]
        found.prepared += 1
        found.frames += seen.frames
        found.bytes += seen.bytes
        found.shards += len(names)
        found.there += sum(name in there for name in names)
    return found


def _aside(folder: Path) -> dict[str, str]:
    found = {}
    for file in sorted((folder / jobs.ASIDE).glob("*.json")):
        try:
            found[file.stem] = str(json.loads(read_small(file))["why"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError, TactileError):
            found[file.stem] = "its reason cannot be read"
    return found


def damaged(folder: Path, progress: Callable[[int, int], None]) -> list[Path]:
    """Return a job's files that are damaged, or missing by its manifest. progress : called with (files done, in all)"""
    shards = [shard for recording in _read(folder) for shard in recording.shards]
    listed = {folder / jobs.SHARDS / Path(shard.file).name: shard.sha256 for shard in shards}
    there = [*(folder / jobs.PREPARED).glob("*.h5"), *(folder / jobs.SHARDS).glob("*.h5")]
    files = sorted({*there, *listed})
    bad = []
    for index, file in enumerate(files):
        digest = checksummed.verified_checksum(file)
        if digest is None or listed.get(file, digest) != digest:
            bad.append(file)
        progress(index + 1, len(files))
    return bad


def warnings(folder: Path) -> dict[str, list[str]]:
    """Return recording -> warnings, by the manifest, without recordings that have none."""
    return {recording.name: recording.warnings for recording in _read(folder) if recording.warnings}


def _read(folder: Path) -> list[_Recording]:
    """Return the recordings in the manifest; [] if it is missing or unreadable."""
    try:
        return msgspec.json.decode(read_small(folder / jobs.MANIFEST, jobs.MOST), type=_Manifest).recordings
    except (OSError, ValueError, RecursionError, TactileError):
        return []


class _Shard(msgspec.Struct):
    file: str
    sha256: str


class _Recording(msgspec.Struct):
    shards: list[_Shard]
    name: str = ""
    warnings: list[str] = []


class _Manifest(msgspec.Struct):
    recordings: list[_Recording]


def write(folder: Path, job: Job) -> None:
    """Write ``manifest.json``: recordings in order, with shards and hashes; the same job gives the same bytes."""
    content = {
        "format": FORMAT,
        "job": job.id,
        "recordings": [_recording(folder, job, i) for i in range(len(job.inputs))],
    }
    atomic.write_json(folder / jobs.MANIFEST, content | {"aside": _aside(folder)}, shared=True)


def _recording(folder: Path, job: Job, index: int) -> dict[str, Any]:
    one = job.inputs[index]
    seen = jobs.module_for(job.recipe).inspect_input(folder, job, index) or jobs.InputFacts(0)
    try:
        warnings = list(seen.warnings())
    except TactileError:  # its prepared file is damaged: the next run makes it again
        seen, warnings = jobs.InputFacts(0), []
    listed: dict[str, Any] = {"name": one.name, "sha256": one.sha256, "frames": seen.frames, "shards": []}
    for number in range(seen.shards):
        path = jobs.shard_file(folder, one.name, number)
        digest, _ = checksummed.stated(path)
        if digest is not None:
            listed["shards"].append({"file": path.name, "sha256": digest})
    return listed | {"warnings": warnings}


FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}  # disk, quota, the system's limit on a file


def refused(folder: Path, job: Job, error: OSError) -> TactileError:
    """Return the error for an OSError of writing: what was removed, not writable, or how much space is needed."""
    if not jobs.exists(folder):
        return TactileError(folder, "was removed while the job ran", "the job's folder", "Begin it again")
    reason = error.strerror or str(error)
    if error.errno not in FULL:
        where = error.filename2 or error.filename or folder
        return TactileError(where, f"cannot be written ({reason})", "a job folder of ours that can be written")
    found = f"cannot be written ({reason}; {_megabytes(shutil.disk_usage(folder).free)} free)"
    return TactileError(f"--out {folder}", found, _needed(folder, job), "Make room and give the same command again")


def _needed(folder: Path, job: Job) -> str:
    """Return in words how much space is still needed, by the shards made so far, or by their kind's estimate."""
    state = status(folder, job)
    sizes = [file.stat().st_size for file in (folder / jobs.SHARDS).glob("*.h5")]
    left, unseen = state.shards - state.there, state.recordings - state.prepared
    one = sum(sizes) / len(sizes) if sizes else state.bytes / max(state.shards, 1)
    parts = [f"some {_megabytes(left * one)} for the {left} shards that are left"] if left and one else []
    if unseen:
        parts.append(f"room for {unseen} of {state.recordings} inputs that were not begun, and their shards")
    return " and ".join(parts) or "room for what is left"


def _megabytes(count: float) -> str:
    return f"{count / 1e6:.1f} MB"
