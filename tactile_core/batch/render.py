"""`tactile render` by many processes: the same folder as by one, but for timings.json, which only one can tell."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from .. import atomic, pack, results
from ..convert import frames_text
from ..errors import TactileError
from ..optics.job import Options, claimed, note_of, pictures
from ..optics.variant import variant_for
from . import inputs, parts
from . import job as jobs
from . import run as runs
from .job import Job
from .kinds import render as kind
from .recipes import Render
from .run import Place


def render_in_parts(
    path: str | os.PathLike,
    out: str | os.PathLike,
    options: Options,
    place: Callable[[Path], Place],
    progress: Callable[[int, int], None],
) -> Path:
    """As ``optics.job.render``; the job is in ``<out>.parts`` until all is there, and the same call goes on with it.

    place : where frames are rendered, from the job's folder; progress : (tasks done, known so far)
    Raises what ``optics.job.render`` raises.
    """
    out = Path(out)
    job = plan(path, out, options)
    with parts.begun(out, job) as folder:
        parts.check(runs.run(folder, job, place(folder), None, progress))
        try:
            _put_together(folder, job, out, options)
        except OSError as error:
            found, advice = f"cannot be written ({error.strerror or error})", "Make room, then give the command again"
            raise TactileError(out, found, "a writable folder", advice) from error
        parts.finished(folder)
    return out


def plan(path: str | os.PathLike, out: str | os.PathLike, options: Options) -> Job:
    """The job. Raises TactileError for what can be refused before any work."""
    preset = claimed(Path(out), options)
    file = Path(path).resolve()
    file = file / "scene.toml" if file.is_dir() else file
    unit = "" if options.calibration is None else inputs.unit_hash(Path(options.calibration))
    frames = "" if frames_text(options.frames) == "all" else frames_text(options.frames)
    recipe = Render(
        preset, variant_for(preset, options.variant), frames or ":", options.size, options.exr, options.noise, unit
    )
    calibration = None if options.calibration is None else os.fspath(options.calibration)
    return jobs.make(inputs.hashed([file], lambda done, total: None), recipe, None, calibration)


def _put_together(folder: Path, job: Job, out: Path, options: Options) -> None:
    words, heights, count = kind.told(folder, job, 0)
    name, recipe = job.inputs[0].name, job.recipe
    shape = None
    if heights:
        shape = pack.read(jobs.prepared_file(folder, name), slice(0, 1), (kind.VALUES,))[kind.VALUES].shape[1:]
    made = pictures(
        job.calibration, recipe.preset, recipe.variant or None, shape, recipe.size, recipe.noise, recipe.exr
    )
    with atomic.new_folder(out, overwrite=options.overwrite) as partial:
        made.begin(partial)
        made.write_rest(partial)
        for number in range(kind.count(folder, job, 0)):
            pack.unpack(jobs.shard_file(folder, name, number), partial)
        note = note_of(job.inputs[0].path, words, count, made.renderer, recipe.preset, options)
        atomic.write_json(partial / results.NOTE, note)
