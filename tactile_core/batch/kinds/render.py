"""Deformed gels to pictures: the frames are read once, then a shard is a pack of some frames' files."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import pack, sealed
from ...errors import TactileError
from .. import job as jobs
from ..inputs import content_hash
from . import Seen
from .batch import check_unit

if TYPE_CHECKING:
    from ...optics.job import Pictures
    from ..job import Job
    from ..recipes import Render

GROWS = False
NUMBERS, VALUES, KIND, HEIGHTS = "numbers", "values", "kind", "heights"  # arrays of a prepared file


def first(folder: Path, job: Job, index: int) -> tuple[int, bool]:
    """Read the input, simulating a scene; keep what is to be rendered of it."""
    from ...convert import parse_frames, select
    from ...optics.inputs import read_frames

    one = job.inputs[index]
    file = jobs.prepared_file(folder, one.name)
    made = sealed.digest_of(file) is None
    if made:
        if content_hash(Path(one.path))[0] != one.sha256:
            found = "another content than when the job was made"
            raise TactileError(one.path, found, f"sha256 {one.sha256[:12]}...", "Start a new job")
        frames = read_frames(one.path)
        rows = select(parse_frames(job.recipe.frames), len(frames.numbers))
        told = {NUMBERS: frames.numbers[rows], VALUES: np.stack(list(frames.some(rows)))}
        kind = np.frombuffer(frames.kind.encode(), np.uint8)
        pack.write(file, told | {KIND: kind, HEIGHTS: np.bool_(frames.heights is not None)})
    return count(folder, job, index), made


def make(folder: Path, job: Job, index: int, number: int) -> bool:
    """Render some frames."""
    one, recipe = job.inputs[index], job.recipe
    file = jobs.shard_file(folder, one.name, number)
    if sealed.digest_of(file) is not None:
        return False
    start = number * recipe.shard_frames
    found = pack.read(
        jobs.prepared_file(folder, one.name), slice(start, start + recipe.shard_frames), (NUMBERS, VALUES)
    )
    shape = found[VALUES].shape[1:] if told(folder, job, index)[1] else None
    pictures = _pictures(job.calibration, recipe, shape)
    with tempfile.TemporaryDirectory() as name:
        pictures.begin(Path(name))
        for frame, values in zip(found[NUMBERS], found[VALUES], strict=True):
            pictures.write_frame(Path(name), int(frame), values)
        pack.write_files(file, Path(name))
    return True


def seen(folder: Path, job: Job, index: int) -> Seen | None:
    """Frames of an input that was read."""
    if not jobs.prepared_file(folder, job.inputs[index].name).exists():
        return None
    frames = _frames(folder, job, index)
    return Seen(count(folder, job, index), frames)


def count(folder: Path, job: Job, index: int) -> int:
    """Shards of an input that was read."""
    return -(-_frames(folder, job, index) // job.recipe.shard_frames)


def told(folder: Path, job: Job, index: int) -> tuple[str, bool, int]:
    """Of an input that was read: its kind in words, whether it holds height maps, its frames."""
    found = pack.read(jobs.prepared_file(folder, job.inputs[index].name), names=(KIND, HEIGHTS))
    return found[KIND].tobytes().decode(), bool(found[HEIGHTS]), _frames(folder, job, index)


def _frames(folder: Path, job: Job, index: int) -> int:
    return len(pack.read(jobs.prepared_file(folder, job.inputs[index].name), names=(NUMBERS,))[NUMBERS])


@functools.lru_cache(maxsize=2)
def _pictures(calibration: str | None, recipe: Render, heights: tuple[int, int] | None) -> Pictures:
    """The renderer, once a process; heights : (H, W) of height maps, None for displacements."""
    from ...optics.job import pictures

    check_unit(calibration, recipe.calibration)
    preset, variant = recipe.preset, recipe.variant or None
    return pictures(calibration, preset, variant, heights, recipe.size, recipe.noise, recipe.exr)
