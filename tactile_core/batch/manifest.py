"""What a job folder holds, told from its files alone."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .. import atomic, sealed
from . import job as jobs
from . import kinds
from .job import Job

FORMAT = "tactile-batch-1"


@dataclasses.dataclass
class Status:
    """recordings, prepared : numbers of them; shards : of the prepared recordings, of which `there` exist

    frames : of the prepared recordings; aside : task -> why it could not be done
    """

    recordings: int
    prepared: int = 0
    shards: int = 0
    there: int = 0
    frames: int = 0
    aside: dict[str, str] = dataclasses.field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether nothing is missing."""
        return self.prepared == self.recordings and self.there == self.shards


def status(folder: Path, job: Job) -> Status:
    """How far a job is. Reads names and lengths, no content: `damaged` checks that."""
    found = Status(len(job.inputs), aside=_aside(folder))
    there = {path.name for path in (folder / jobs.SHARDS).glob("*.h5")}
    for index, one in enumerate(job.inputs):
        seen = kinds.of(job).seen(folder, job, index)
        if seen is None:
            continue
        names = [jobs.shard_file(folder, one.name, number).name for number in range(seen.shards)]
        found.prepared += 1
        found.frames += seen.frames
        found.shards += len(names)
        found.there += sum(name in there for name in names)
    return found


def _aside(folder: Path) -> dict[str, str]:
    found = {}
    for file in sorted((folder / jobs.ASIDE).glob("*.json")):
        try:
            found[file.stem] = str(json.loads(file.read_text(encoding="utf-8"))["why"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            found[file.stem] = "its reason cannot be read"
    return found


def damaged(folder: Path, progress: Callable[[int, int], None]) -> list[Path]:
    """Files of a job that are not as they were written; each is read once. progress : (files done, in all)"""
    files = sorted([*(folder / jobs.PREPARED).glob("*.h5"), *(folder / jobs.SHARDS).glob("*.h5")])
    bad = []
    for index, file in enumerate(files):
        if sealed.digest_of(file) is None:
            bad.append(file)
        progress(index + 1, len(files))
    return bad


def write(folder: Path, job: Job) -> None:
    """``manifest.json``: recordings in order, their shards and hashes; the same job gives the same bytes."""
    content = {
        "format": FORMAT,
        "job": job.id,
        "recordings": [_recording(folder, job, i) for i in range(len(job.inputs))],
    }
    atomic.write_json(folder / jobs.MANIFEST, content | {"aside": _aside(folder)})


def _recording(folder: Path, job: Job, index: int) -> dict[str, Any]:
    one = job.inputs[index]
    seen = kinds.of(job).seen(folder, job, index) or kinds.Seen(0)
    told: dict[str, Any] = {"name": one.name, "sha256": one.sha256, "frames": seen.frames, "shards": []}
    for number in range(seen.shards):
        path = jobs.shard_file(folder, one.name, number)
        digest = sealed.seal_of(path)
        if digest is not None:
            told["shards"].append({"file": path.name, "sha256": digest})
    return told | {"warnings": list(seen.warnings)}
