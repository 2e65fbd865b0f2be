"""A shard: some frames of a recording, translated, in a checksummed HDF5 file of the layout of ``frames_file``.

Its attributes name the recording and its hash, the recipe's hash, and which shard of how many it is; the rows are
frames `number * shard_frames` to that of the next. Pictures are the dataset ``image``.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..files import atomic, checksummed
from ..files.hdf5_checked import open_plain
from .engine import job as jobs
from .frame_pass import CHUNK, Tools, translated
from .frames_file import FramesFile, kept
from .prepared_signals import Prepared

if TYPE_CHECKING:
    from ..recordings import Signals
    from ..translation.contact_track import Tracked
    from .engine.job import Job


def count(frames: int, job: Job) -> int:
    """Return the number of shards of a recording of so many frames."""
    return -(-frames // job.recipe.shard_frames)


def make(folder: Path, job: Job, index: int, number: int, tools: Tools) -> bool:
    """Make shard `number` of recording `index` unless it is there and whole; returns whether it was made.

    Raises TactileError for a damaged prepared file, OSError where the disk cannot be written.
    """
    name = job.inputs[index].name
    file = jobs.shard_file(folder, name, number)
    prepared = Prepared(jobs.prepared_file(folder, name))
    about, frames = prepared.about(), len(prepared)
    if checksummed.verified_checksum(file) is not None and is_of(file, job, index, number, frames):
        return False
    start = number * job.recipe.shard_frames
    stop = min(start + job.recipe.shard_frames, frames)
    time, signals = prepared.rows(start, stop)
    tracked = tools.tracked(prepared.rows, frames)
    attributes = {
        "recording": about["recording"].encode(errors="replace").decode(),
        "simulated": about["simulated"], **_identity(job, index, number, frames),
    }  # fmt: skip
    pair = tools.source, tools.target
    with atomic.new_file(file, shared=True) as partial:
        keep = tuple(job.recipe.keep)
        words, room = kept(keep, tools.answer), checksummed.ROOM
        with FramesFile(partial, stop - start, words, attributes, room=room, pair=pair) as out:
            for first in range(0, stop - start, CHUNK):
                rows = slice(first, first + CHUNK)
                out.write(first, _arrays(signals, time, rows, start, keep, tools, tracked))
            out.annotate("time", start_time=about["start_time"])
            out.annotate("electrodes", rest=signals.rest, kind=signals.kind)
            if "marker_motion" in keep:
                out.annotate("marker_motion", rest=tools.needed_dots().rest)
        checksummed.write_checksum(partial)
    return True


def is_of(file: Path, job: Job, index: int, number: int, frames: int) -> bool:
    """Return true if a whole shard is shard `number` of recording `index`, alone under its name, with these frames."""
    try:
        with open_plain(file) as found:
            return all(found.attrs[name] == value for name, value in _identity(job, index, number, frames).items())
    except Exception:  # the library raises a dozen types on what is no shard
        return False


def _identity(job: Job, index: int, number: int, frames: int) -> dict[str, str | int]:
    """The attributes that distinguish a shard from others."""
    return {
        "recording_sha256": job.inputs[index].sha256, "recipe": job.id, "shard": number, "shards": count(frames, job)
    }  # fmt: skip


def _arrays(
    signals: Signals,
    time: np.ndarray,
    rows: slice,
    start: int,
    keep: tuple[str, ...],
    tools: Tools,
    tracked: Tracked | None,
) -> dict[str, np.ndarray]:
    """Compute all arrays of some rows of a shard that begins at frame `start`."""
    frames = np.arange(len(time), dtype=np.int32)[rows] + np.int32(start)
    arrays = translated(signals.at(rows), tools, tracked, frames)
    arrays |= {"frame": frames, "time": time[rows]}
    if "traction" in keep:
        from .gel_traction import gel_traction  # with all of contact mechanics

        arrays |= gel_traction(arrays, tools.target)
    if "marker_motion" in keep:
        arrays |= tools.marker_motion(arrays["displacement_digit"])
    if "height" in keep or "image" in keep:
        arrays["height_map"] = tools.height_map(arrays["displacement_digit"])
    if "image" in keep:
        heights, moved = arrays["height_map"], arrays["displacement_digit"]
        arrays["image"] = np.stack([tools.draw(*each) for each in zip(heights, moved, strict=True)])
    return arrays
