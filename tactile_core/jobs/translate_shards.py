"""Recordings to translated frames: the signals of each are prepared once, then its shards are made of them."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import TactileError
from . import frame_shard, prepared_signals
from .engine import job as jobs
from .engine.inputs import unit_hash
from .engine.kinds import InputFacts
from .frame_pass import Tools

if TYPE_CHECKING:
    from ..translation.answer import Answer
    from .engine.job import Job
    from .results import Gel

GROWS = False
# kB a frame of a shard, of the shipped recording: what is always there, and each word of --keep beyond it.
ALWAYS_KB = 0.8
KEEP_KB = {"latent": 0.5, "displacement": 78, "height": 199, "image": 101, "traction": 0.2, "marker_motion": 0.5}


def prepare_input(folder: Path, job: Job, index: int) -> tuple[int, bool]:
    """Prepare a recording."""
    frames, made = prepared_signals.make(folder, job, index)
    return frame_shard.count(frames, job), made


def make(folder: Path, job: Job, index: int, number: int) -> bool:
    """Translate some frames."""
    recipe = job.recipe
    unit = job.calibration, recipe.calibration, recipe.preset, recipe.variant
    way = recipe.answer, recipe.gel, recipe.source, recipe.target
    return frame_shard.make(folder, job, index, number, _tools(job.weights, recipe.weights, *unit, *way))


def inspect_input(folder: Path, job: Job, index: int) -> InputFacts | None:
    """Return the shards, frames and warnings of a prepared recording."""
    file = jobs.prepared_file(folder, job.inputs[index].name)
    try:
        about = prepared_signals.Prepared(file).about()
    except TactileError:  # none yet, or a damaged one, which the next run makes again
        return None
    frames, kb = about["frames"], sum((KEEP_KB[word] for word in job.recipe.keep), ALWAYS_KB)
    return InputFacts(frame_shard.count(frames, job), frames, tuple(about["warnings"]), int(1e3 * kb * frames))


@functools.lru_cache(maxsize=2)
def _tools(
    weights: str | None,
    sha256: str,
    calibration: str | None,
    unit_sha256: str,
    preset: str,
    variant: str,
    answer: Answer,
    gel: Gel,
    source: str,
    target: str,
) -> Tools:
    """Load the networks and the unit, once a process. Raises TactileError where they are not those of the job."""
    from .convert import load_tools

    check_unit(calibration, unit_sha256)
    tools = load_tools(weights, calibration, preset, variant or None, answer, gel, target, source)
    if tools.sha256 != sha256:
        found, advice = f"sha256 {tools.sha256[:12]}...", "Use the weights that the job was made with"
        raise TactileError(weights or "the shipped weights", found, f"{sha256[:12]}..., as in the job", advice)
    return tools


def check_unit(calibration: str | None, sha256: str) -> None:
    """Raise TactileError for a calibration that is not the one the job was made with."""
    if calibration is not None and unit_hash(Path(calibration)) != sha256:
        advice = "Use the calibration that the job was made with"
        raise TactileError(calibration, "another content", f"sha256 {sha256[:12]}..., as in the job", advice)
