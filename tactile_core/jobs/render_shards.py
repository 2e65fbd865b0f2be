"""Run `tactile render` in many processes: the same folder as from one process, but without timings.json.

``engine.job`` says what `prepare_input`, `make` and `inspect_input` are for."""

from __future__ import annotations

import functools
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..files import atomic, checksummed
from ..pictures.mitsuba.variant import variant_for
from ..sensors.calibration_file import load_calibration
from . import results
from .engine import inputs
from .engine import job as jobs
from .engine import run as runs
from .engine.job import InputFacts, Job, Render
from .engine.run import Place
from .gel_frames import read_frames
from .render import Options, Pictures, claimed, note_of, pictures
from .results import frames_text, parse_frames, select
from .translate_shards import check_unit

NUMBERS, VALUES, KIND, HEIGHTS = "numbers", "values", "kind", "heights"  # arrays of a prepared file


def render_in_parts(
    path: str | os.PathLike,
    out: str | os.PathLike,
    options: Options,
    place: Callable[[Path], Place],
    progress: Callable[[int, int], None],
) -> Path:
    """Render the input `path` into `out` by a job in ``<out>.parts``, which the same call resumes; return `out`.
    place : function from the job's folder to an executor; progress : called with (tasks done, known so far)"""
    out = Path(out)
    job = plan(path, out, options)
    with (
        runs.completed(out, job, place, progress) as folder,
        atomic.writing(out, advice="Make room, then give the command again"),
    ):
        _put_together(folder, job, out, options)
    return out


def plan(path: str | os.PathLike, out: str | os.PathLike, options: Options) -> Job[Render]:
    """Return the job that renders a file, or a folder's scene.toml, into the folder `out`. Raises TactileError for what
    can be refused before any work."""
    preset = claimed(Path(out), options)
    file = Path(path).resolve()
    file = file / "scene.toml" if file.is_dir() else file
    unit = "" if options.calibration is None else inputs.unit_hash(Path(options.calibration))
    frames = frames_text(options.frames).replace("all", ":")
    recipe = Render(
        preset, variant_for(preset, options.variant), frames, options.size, options.exr, options.noise, unit,
        options.object_reflectance,
    )  # fmt: skip
    calibration = None if options.calibration is None else os.fspath(options.calibration)
    return jobs.make(inputs.hashed([file], lambda done, total: None), recipe, None, calibration)


def _put_together(folder: Path, job: Job[Render], out: Path, options: Options) -> None:
    words, heights = input_kind(folder, job)
    frames = _frames(folder, job)
    name, recipe = job.inputs[0].name, job.recipe
    shape = None
    if heights:
        shape = _prepared(folder, job, VALUES, rows=slice(0, 1))[VALUES].shape[1:]
    made = _pictures(job.calibration, recipe, shape)
    with atomic.new_folder(out, overwrite=options.overwrite) as partial:
        made.begin(partial)
        made.write_rest(partial)
        for number in range(count(folder, job)):
            checksummed.unpack(jobs.shard_file(folder, name, number), partial)
        note = note_of(job.inputs[0].path, words, frames, made.renderer, recipe.preset, options)
        atomic.write_json(partial / results.NOTE, note)


def prepare_input(folder: Path, job: Job[Render], index: int) -> tuple[int, bool]:
    """Read the input (a scene is simulated) and store its values; return the number of shards, and true if read now."""
    one = job.inputs[index]
    file = jobs.prepared_file(folder, one.name)
    made = checksummed.verified_checksum(file) is None
    if made:
        inputs.check_unchanged(one)
        frames = read_frames(one.path, gel=load_calibration(job.calibration).camera.sensor)
        rows = select(parse_frames(job.recipe.frames), len(frames.numbers))
        arrays = {NUMBERS: frames.numbers[rows], VALUES: np.stack(list(frames.iterate_rows(rows)))}
        kind = np.frombuffer(frames.kind.encode(), np.uint8)
        checksummed.write(file, arrays | {KIND: kind, HEIGHTS: np.bool_(frames.heights is not None)})
    return count(folder, job), made


def make(folder: Path, job: Job[Render], index: int, number: int) -> bool:
    """Render the frames of shard `number`, unless they are there; return true if they were rendered."""
    one, recipe = job.inputs[index], job.recipe
    file = jobs.shard_file(folder, one.name, number)
    if checksummed.verified_checksum(file) is not None:
        return False
    start = number * recipe.shard_frames
    found = _prepared(folder, job, NUMBERS, VALUES, rows=slice(start, start + recipe.shard_frames))
    shape = found[VALUES].shape[1:] if input_kind(folder, job)[1] else None
    pictures = _pictures(job.calibration, recipe, shape)
    with tempfile.TemporaryDirectory() as name:
        pictures.begin(Path(name))
        for frame, values in zip(found[NUMBERS], found[VALUES], strict=True):
            pictures.write_frame(Path(name), int(frame), values)
        checksummed.write_files(file, Path(name))
    return True


def inspect_input(folder: Path, job: Job[Render], index: int) -> InputFacts | None:
    """Return the number of frames and shards of the job's input; None if it is not prepared."""
    if not jobs.prepared_file(folder, job.inputs[index].name).exists():
        return None
    return InputFacts(count(folder, job), _frames(folder, job))


def count(folder: Path, job: Job[Render]) -> int:
    """Return the number of shards of the prepared input."""
    return -(-_frames(folder, job) // job.recipe.shard_frames)


def input_kind(folder: Path, job: Job[Render]) -> tuple[str, bool]:
    """Return the prepared input's kind in words, and true if it holds height maps."""
    found = _prepared(folder, job, KIND, HEIGHTS)
    return found[KIND].tobytes().decode(), bool(found[HEIGHTS])


def _frames(folder: Path, job: Job[Render]) -> int:
    return len(_prepared(folder, job, NUMBERS)[NUMBERS])


def _prepared(folder: Path, job: Job[Render], *names: str, rows: Any = ()) -> dict[str, np.ndarray]:
    """Return arrays of the prepared input by their names; rows : index that selects rows of those that have any"""
    return checksummed.read(jobs.prepared_file(folder, job.inputs[0].name), rows, names)


@functools.lru_cache(maxsize=2)
def _pictures(calibration: str | None, recipe: Render, heights: tuple[int, int] | None) -> Pictures:
    """Return the writer of pictures, made once per process; heights : (H, W) of height maps, None for displacements"""
    check_unit(calibration, recipe.calibration)
    options = Options(
        calibration=calibration, size=recipe.size, exr=recipe.exr, variant=recipe.variant or None, noise=recipe.noise,
        object_reflectance=recipe.object_reflectance,
    )  # fmt: skip
    return pictures(options, recipe.preset, heights)
