"""Make shards of translated frames from recordings: the recipe of such a job, and its tasks. Each recording's signals
are prepared once, then its shards are made.

A shard is a checksummed HDF5 file in the layout of ``frames_file``, pictures included. Its attributes name the
recording and its hash, the recipe's hash, its number and the number of shards; its rows are frames from `number *
shard_frames` up to those of the next."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from ..errors import TactileError
from ..files import atomic, checksummed
from ..files.hdf5_checked import open_checked
from ..pictures.mitsuba.variant import variant_for
from ..pictures.presets import FAST
from ..recordings import readers
from ..sensors.calibration_file import load_calibration
from . import convert, prepared_signals
from .convert import ToolOptions
from .engine import job as jobs
from .engine.inputs import unit_hash
from .engine.job import MAX_SHARD_FRAMES, InputFacts, Translate
from .frame_pass import FramePass, Tools, describe_gel
from .prepared_signals import Prepared
from .results import TRANSLATED

if TYPE_CHECKING:
    from .engine.job import Job

# kB per frame of a shard, of the shipped recording: what is always there, and each word of --keep beyond it.
ALWAYS_KB = 0.8
KEEP_KB = {"latent": 0.5, "displacement": 78, "height": 199, "image": 101, "traction": 0.2, "marker_motion": 0.5}


def completed(
    wanted: Translate, paths: Sequence[Path], say: Callable[[str], None], weights: str | None, calibration: str | None
) -> Translate:
    """Return the recipe of a job on these recordings, with the hashes, source and variant that follow from its files.

    wanted : what was asked for, its preset "" for fast pictures, if any; say : called with sentences on what is
        approximated; weights : folder, calibration : file, None for those that ship
    Raises TactileError for options that do not go together, and for unknown names."""
    wanted.prepare.options().check()
    source = None if weights else readers.sensor_of_first(paths, wanted.prepare.columns)
    tools = ToolOptions(weights, answer=wanted.answer, gel=wanted.gel, target=wanted.target, source=source)
    network, gel = tools.load_networks()
    if wanted.shard_frames > MAX_SHARD_FRAMES:
        raise TactileError("--shard-frames", str(wanted.shard_frames), f"1 to {MAX_SHARD_FRAMES}")
    if gel != TRANSLATED:
        from . import solved_gel

        solved_gel.check_installed()
    unit = load_calibration(calibration, wanted.target)
    for sentence in describe_gel(wanted.target, network.target):
        say(sentence)
    if wanted.preset and "image" not in wanted.keep:
        raise TactileError("--preset", wanted.preset, "--keep image", "Keep the pictures that it makes")
    if "marker_motion" in wanted.keep:
        from ..pictures.marker_field import MarkerField

        MarkerField(unit)  # refused here where the unit has no dots
    preset = wanted.preset or FAST
    return msgspec.structs.replace(
        wanted, weights=network.sha256, source=network.source, preset=preset, variant=variant_for(preset),
        calibration="" if calibration is None else unit_hash(Path(calibration)),
    )  # fmt: skip


def translated(frames: int, job: Job[Translate]) -> int:
    """Return the number of translated frames of a recording of `frames` frames."""
    return -(-frames // job.recipe.every)


def count(frames: int, job: Job[Translate]) -> int:
    """Return the number of shards of a recording of ``frames`` frames."""
    return -(-translated(frames, job) // job.recipe.shard_frames)


def prepare_input(folder: Path, job: Job[Translate], index: int) -> tuple[int, bool]:
    """Prepare a recording; return the number of its shards, and true if it was prepared now."""
    frames, made = prepared_signals.make(folder, job, index)
    return count(frames, job), made


def make(folder: Path, job: Job[Translate], index: int, number: int) -> bool:
    """Translate shard `number` of recording `index` unless it is whole; return true if it was translated. Raises
    TactileError, and OSError of the disk."""
    recipe, name = job.recipe, job.inputs[index].name
    pictures, pair = (job.calibration, recipe.preset, recipe.variant or None), (recipe.target, recipe.source)
    options = ToolOptions(job.weights, *pictures, recipe.answer, recipe.gel, *pair)
    tools = _tools(options, recipe.weights, recipe.calibration)
    file, prepared = jobs.shard_file(folder, name, number), Prepared(jobs.prepared_file(folder, name))
    about, total = prepared.about(), len(prepared)
    if checksummed.verified_checksum(file) is not None and is_of(file, job, index, number, total):
        return False
    start = number * recipe.shard_frames
    frames = recipe.every * np.arange(start, min(start + recipe.shard_frames, translated(total, job)))
    attributes = {
        "recording": about["recording"].encode(errors="replace").decode(),
        "simulated": about["simulated"], **_identity(job, index, number, total),
    }  # fmt: skip
    made, signals = FramePass(tools, prepared.read, total, recipe.keep), prepared.read(frames[:1])[1]
    with atomic.new_file(file, shared=True) as unfinished:
        made.write(unfinished, frames, signals, about["start_time"], attributes, room=checksummed.ROOM)
        checksummed.write_checksum(unfinished)
    return True


def is_of(file: Path, job: Job[Translate], index: int, number: int, frames: int) -> bool:
    """Return true if a file, known to be whole, is shard `number` of recording `index`, of `frames` frames."""
    try:
        with open_checked(file) as found:
            return all(found.attrs[name] == value for name, value in _identity(job, index, number, frames).items())
    except Exception:  # the library raises a dozen types on what is no shard
        return False


def _identity(job: Job[Translate], index: int, number: int, frames: int) -> dict[str, str | int]:
    """Return the attributes that tell shard `number` of recording `index`, of so many frames, from others."""
    return {
        "recording_sha256": job.inputs[index].sha256, "recipe": job.id, "shard": number, "shards": count(frames, job)
    }  # fmt: skip


def inspect_input(folder: Path, job: Job[Translate], index: int) -> InputFacts | None:
    """Return the facts of a prepared recording: shards, frames, warnings, bytes; None if it is not prepared."""
    file = jobs.prepared_file(folder, job.inputs[index].name)
    _, frames = checksummed.stated(file)
    if frames is None:  # none yet, or a damaged one, which the next run makes again
        return None
    done = translated(frames, job)
    kb = sum((KEEP_KB[word] for word in job.recipe.keep), ALWAYS_KB)
    return InputFacts(count(frames, job), done, lambda: tuple(Prepared(file).about()["warnings"]), int(1e3 * kb * done))


@functools.lru_cache(maxsize=2)
def _tools(options: ToolOptions, sha256: str, unit_sha256: str) -> Tools:
    """Return networks and drawer, loaded once per process. Raises TactileError if they are not the job's."""
    check_unit(options.calibration, unit_sha256)
    tools = convert.load_tools(options)
    if tools.translator.sha256 != sha256:
        found, advice = f"sha256 {tools.translator.sha256[:12]}...", "Use the weights that the job was made with"
        raise TactileError(options.weights or "the shipped weights", found, f"{sha256[:12]}..., as in the job", advice)
    return tools


def check_unit(calibration: str | None, sha256: str) -> None:
    """Raise TactileError if the calibration in a file has another hash than ``sha256``, the one a job was made with."""
    if calibration is not None and unit_hash(Path(calibration)) != sha256:
        advice = "Use the calibration that the job was made with"
        raise TactileError(calibration, "another content", f"sha256 {sha256[:12]}..., as in the job", advice)
