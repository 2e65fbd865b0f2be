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
from .gel_frames import HEIGHTS, read_frames
from .render import Options, Pictures, claimed, note_of, pictures
from .results import frames_text, parse_frames, select
from .translate_shards import check_unit

NUMBERS, VALUES, KIND = "numbers", "values", "kind"  # arrays of a prepared file


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
    kind, name, recipe = _kind(folder, job), job.inputs[0].name, job.recipe
    first = _prepared(folder, job, VALUES, rows=slice(0, 1))[VALUES]
    made = _pictures(job.calibration, recipe, kind, first.shape[1:])
    with atomic.new_folder(out, overwrite=options.overwrite) as partial:
        made.begin(partial)
        made.write_rest(partial)
        for number in range(count(folder, job)):
            checksummed.unpack(jobs.shard_file(folder, name, number), partial)
        frames = _frames(folder, job)
        note = note_of(job.inputs[0].path, kind, frames, made.renderer, recipe.preset, options)
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
        checksummed.write(file, arrays | {KIND: kind})
    return count(folder, job), made


def make(folder: Path, job: Job[Render], index: int, number: int) -> bool:
    """Render the frames of shard `number`, unless they are there; return true if they were rendered."""
    one, recipe = job.inputs[index], job.recipe
    file = jobs.shard_file(folder, one.name, number)
    if checksummed.verified_checksum(file) is not None:
        return False
    start = number * recipe.shard_frames
    found = _prepared(folder, job, NUMBERS, VALUES, rows=slice(start, start + recipe.shard_frames))
    pictures = _pictures(job.calibration, recipe, _kind(folder, job), found[VALUES].shape[1:])
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


def _kind(folder: Path, job: Job[Render]) -> str:
    return _prepared(folder, job, KIND)[KIND].tobytes().decode()


def _frames(folder: Path, job: Job[Render]) -> int:
    return len(_prepared(folder, job, NUMBERS)[NUMBERS])


def _prepared(folder: Path, job: Job[Render], *names: str, rows: Any = ()) -> dict[str, np.ndarray]:
    """Return arrays of the prepared input by their names; rows : index that selects rows of those that have any"""
    return checksummed.read(jobs.prepared_file(folder, job.inputs[0].name), rows, names)


@functools.lru_cache(maxsize=2)
def _pictures(calibration: str | None, recipe: Render, kind: str, shape: tuple[int, int]) -> Pictures:
    """Return the writer of pictures, made once per process. kind : the input's; shape : of a frame's values"""
    check_unit(calibration, recipe.calibration)
    options = Options(
        calibration=calibration, size=recipe.size, exr=recipe.exr, variant=recipe.variant or None, noise=recipe.noise,
        object_reflectance=recipe.object_reflectance,
    )  # fmt: skip
    return pictures(options, recipe.preset, shape if kind == HEIGHTS else None)
