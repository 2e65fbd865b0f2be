"""``tactile batch``: translate many recordings, in many processes or on many machines."""

from __future__ import annotations

import argparse
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from ...errors import TactileError
from ..terminal import bar, complain, counted, next_step, say, tell
from . import engine
from .common import ANSWER, PREPARE, PRESETS, RESUMES, UNIT, add, parse_answer, prepare_words

if TYPE_CHECKING:
    from ...jobs.engine.job import Job, Translate

BRIEF = "translate many recordings, resumable, on one machine or many"
TEXT = """\
Convert recordings into the job folder DIR:
  job.json      inputs and their hashes, weights, options; written once
  shards/       HDF5 files, each of some frames of one recording, laid out as frames.h5; pictures are inside
  aside/        recordings and shards that failed, and why; the next run tries them again
  manifest.json all shards and their hashes, once the job is done
Only missing or damaged shards are made, so the same command continues after any interruption. Without INPUTS it
does not check whether recordings changed. The bytes do not depend on the number of workers. INPUTS are files, folders,
globs (quoted) and @LIST, a text file with one path a line."""
EPILOG = """\
examples:
  tactile batch day1 'day2/*.csv' --out job --workers 8
  tactile batch --out job --status
  tactile batch --out job --verify
  tactile batch --out job --array $SLURM_ARRAY_TASK_ID/100     one of 100 that share the work, without a scheduler
  tactile batch --out job --cluster tcp://head:8786            on the workers of a Dask scheduler
  tactile batch day1 --out job --plan                          write job.json alone, as arrays need it"""
LEAVES = RESUMES
MOST_WARNINGS = 5  # that are printed
RECIPE = (  # options that decide what is made, which goes on as it was begun
    "keep", "shard_frames", "weights", "sensor", "calibration", "preset", "kind", "counts_per_unit", "smooth",
    "columns", "tare", "no_drift", "polarity", "frames_apart", "answer", "mount_shift", "samples", "contacts", "gel",
    "target",
)  # fmt: skip


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("inputs", nargs="*", metavar="INPUTS", help="recordings; without any, the job in DIR continues")
    verb.add_argument("--out", required=True, metavar="DIR", help="folder of the job")
    add(verb, "--keep", *UNIT)
    verb.set_defaults(keep="latent,displacement")
    verb.add_argument("--shard-frames", type=int, metavar="N", help="frames in a shard (default: 1000)")
    add(verb, *ANSWER)
    about = "preset of the pictures, as of `tactile render` (default: fast)"
    verb.add_argument("--preset", choices=PRESETS, help=about)
    add(verb, *PREPARE)
    engine.place_arguments(verb)
    verb.add_argument("--array", metavar="I/N", help="do only part I of N, counted from 0; other processes do the rest")
    doing = verb.add_mutually_exclusive_group()
    doing.add_argument("--plan", action="store_true", help="write job.json, print what 1,000 frames cost, and stop")
    doing.add_argument("--status", action="store_true", help="print how much of the job is done; changes nothing")
    doing.add_argument("--verify", action="store_true", help="read every shard; exit status 2 if one is damaged")
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Start a job, go on with it or show its state; returns the exit status."""
    from ...jobs.engine import job as jobs
    from ...jobs.engine import run as runs

    folder, part = Path(options.out), engine.part(options.array)
    if options.status or options.verify:
        if options.inputs:
            raise TactileError("--status and --verify", "given with INPUTS", "--out DIR alone")
        job = jobs.read(folder)
        return _status(folder, job) if options.status else _verify(folder, job, options.progress)
    engine.check_place(options, "workers", "shard_frames")
    if part is not None and not jobs.exists(folder):
        raise TactileError(folder, "no job yet", "a job that all parts share", "Make it once with --plan")
    with runs.opened(folder, part):
        job = _job(folder, options)
        if options.plan:
            _say_cost(job)
            engine.tell_plan(folder / jobs.FILE, folder, f"tactile batch --out {quote(str(folder))}")
            return 0
        place = engine.place(folder, options)
        with bar("batch", "task", options.progress) as shown:
            done = runs.run(folder, job, place, part, shown)
    for name, why in done.aside.items():
        complain(f"{name}: {why}")
    if part is None:
        _say_warnings(folder)
    where = str(folder) if part is None else f"{folder}, part {options.array}"
    tell(f"{where}: {counted(done.made, 'shard')} made, {done.kept} kept, {len(done.aside)} set aside")
    if done.aside:
        return 2
    next_step(_following(folder, job, part))
    return 0


def _say_cost(job: Job) -> None:
    """Print what 1,000 frames of a translation job take on one core, in time, memory and disk; reads no input."""
    from ...jobs import plan
    from ...jobs.engine.job import Translate
    from ...jobs.results import TRANSLATED

    if isinstance(job.recipe, Translate):
        asked, solved = job.recipe, job.recipe.gel != TRANSLATED
        for line in plan.of_frames(1000, asked.keep, asked.preset, solved=solved, target=asked.target).lines():
            say(line)


def _say_warnings(folder: Path) -> None:
    """Print the commonest warnings of the job's recordings, each once; the manifest lists those of each recording."""
    from collections import Counter

    from ...jobs.engine import manifest

    counts = Counter(text for texts in manifest.warnings(folder).values() for text in texts)
    for text, number in counts.most_common(MOST_WARNINGS):
        say(f"warning: {counted(number, 'recording')}: {text}")
    if len(counts) > MOST_WARNINGS:
        say(f"warning: {len(counts) - MOST_WARNINGS} others: manifest.json lists those of each recording")


def _following(folder: Path, job: Job, part: tuple[int, int] | None) -> str:
    """Return what to do next, in words, after a job or one part of it has ended without a failure."""
    from ...jobs.engine.job import Translate

    ours, name = isinstance(job.recipe, Translate), quote(str(folder))
    if part is not None:
        then = f"tactile batch --out {name}, which checks all of them" if ours else engine.ASSEMBLES
        return f"when every part has ended: {then}"
    return f"tactile export {name} --to npz --out {quote(str(folder) + '_npz')}" if ours else engine.ASSEMBLES


def _job(folder: Path, options: argparse.Namespace) -> Job:
    """Return the folder's job, or make one from the options. Raises TactileError if they describe another job."""
    from ...jobs.engine import inputs
    from ...jobs.engine import job as jobs

    there = jobs.read_to_run(folder) if jobs.exists(folder) else None
    if not options.inputs:
        if there is None:
            raise TactileError(folder, "no job here", "INPUTS, or the folder of a job", "Name recordings to convert")
        given = [name for name in RECIPE if getattr(options, name) != options.parser.get_default(name)]
        if given:
            raise TactileError("--" + given[0].replace("_", "-"), "given without INPUTS", "the job as it was begun")
        return there
    paths = inputs.find(options.inputs, folder)
    with bar("reading", "file", options.progress) as shown:
        found = inputs.hashed(paths, shown)
    job = jobs.make(found, _recipe(options, paths), options.weights, options.calibration)
    if there is None:
        jobs.check_empty(folder, "Name another --out")
        jobs.write(folder, job)
        return job
    if job.id != there.id:
        held, advice = "holds another job (other recordings, contents, options or version)", "Name another --out folder"
        raise TactileError(folder, held, "the same command that began it", advice)
    return there


def _recipe(options: argparse.Namespace, paths: list[Path]) -> Translate:
    """Return the recipe by which the options translate the recordings of these paths."""
    from ...jobs import results, translate_shards
    from ...jobs.engine.job import SHARD_FRAMES, Prepare, Translate
    from ...recordings import electrode_gains

    wanted = Translate(
        keep=list(results.parse_words(options.keep, results.KEEPABLE, least=0)), weights="",
        sensor=None if options.sensor is None else electrode_gains.read(options.sensor),
        prepare=Prepare(**prepare_words(options)),
        target=options.target, preset=options.preset or "",
        answer=parse_answer(options),
        gel=options.gel, shard_frames=SHARD_FRAMES if options.shard_frames is None else options.shard_frames,
    )  # fmt: skip
    return translate_shards.completed(wanted, paths, say, options.weights, options.calibration)


def _status(folder: Path, job: Job) -> int:
    from ...jobs.engine import job as jobs
    from ...jobs.engine import manifest

    found = manifest.status(folder, job)
    tell(f"inputs      {found.prepared} of {found.recordings} prepared, {found.frames} frames")
    tell(f"shards      {found.there} of {found.shards} of the prepared inputs")
    tell(f"set aside   {len(found.aside)}")
    for name, why in found.aside.items():
        tell(f"  {name}: {why}")
    tell("complete" if found.complete else f"not complete: {jobs.completion(job)}")
    return 0


def _verify(folder: Path, job: Job, progress: bool) -> int:
    from ...jobs.engine import manifest

    with bar("verify", "file", progress) as shown:
        bad = manifest.damaged(folder, shown)
    for file in bad:
        state = "damaged, or another's" if file.exists() else "missing"
        complain(f"{file}: {state}; the same command makes it again")
    if bad:
        return 2
    found = manifest.status(folder, job)
    rest = "" if found.complete else f"; not complete: {found.there} of {found.shards} shards of the prepared inputs"
    say(f"{folder}: every file is as it was written{rest}")
    return 0
