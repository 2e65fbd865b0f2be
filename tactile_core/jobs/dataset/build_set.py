"""Build a data set: find its units, translate the recordings of each as a job, then write layouts, card and page."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import unicodedata
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import TactileError
from ...files import atomic
from ...files.outside import read_small
from ...recordings import read
from ...recordings.electrode_gains import SensorFile
from ...recordings.force_file import read_columns, read_force
from ...recordings.recording import split as chosen
from ...sensors import TARGET
from ...translation.answer import Answer
from .. import export, translate_shards
from ..engine import inputs
from ..engine import job as jobs
from ..engine import run as runs
from ..engine.job import Translate
from ..export import finished_job
from ..export.finished_job import Finished, Recorded
from . import dataset_card, survival
from .collected import TEST, TRAIN, Collected, File, beside, collect
from .recipe import FORCE, Recipe
from .set_units import calibrated, file_name, readable

CARD, PAGE, UNITS, JOBS, REPORT = "README.md", "index.html", "units", "jobs", "dataset.json"
ALL = "all"  # name of the unit where a set has one
KEEP = ("latent", "image")

Bar = Callable[[str, str], AbstractContextManager[Callable[[int, int], None]]]


@dataclass(frozen=True)
class Asked:
    """Options of a data set. layouts : names of ``export.layouts``; place : function from a job's folder to an executor
    say : called with sentences; bar : (name, what it counts) -> context of a callback (done, in all); target : the gel
    preset : of the pictures, None for fast ones; calibration, weights : file and folder, None for those that ship"""

    layouts: Sequence[str]
    place: Callable[[Path], runs.Place]
    say: Callable[[str], None]
    bar: Bar
    target: str = TARGET
    preset: str | None = None
    calibration: str | None = None
    weights: str | None = None


def build(recipe: Recipe, named: str, folder: Path, out: Path, asked: Asked) -> dict[str, str]:
    """Make the data set `out` of the recordings in a folder; what is there already is kept. Return what was left out:
    recording, file or unit -> reason. named : the recipe's name or file. Raises TactileError for the folder of another
    set, for files of others in `out`, if no recording can be translated, and if the disk refuses."""
    found = collect(recipe, folder, out)
    _check_out(out)
    for line in _counted(recipe, found):
        asked.say(line)
    parts, aside = [], dict(found.unfit)
    for unit, every in found.units().items():
        files, unread = readable(recipe, every)
        aside |= unread
        try:
            kept = out / UNITS / f"{file_name(unit) or ALL}.toml"
            sensor = calibrated(recipe, files, folder, kept, asked.weights, asked.say) if files else None
        except TactileError as error:
            if isinstance(error.__cause__, OSError) and not isinstance(error.__cause__, FileNotFoundError):
                raise  # the disk, and no file of the set
            files, aside[unit or folder.name] = [], str(error)
        if files:
            parts.append((unit, files, _translated(recipe, unit, files, sensor, out, asked)))
    for why in aside.values():
        asked.say(f"set aside: {why}")
    parts = [part for part in parts if part[2].recordings]
    if not parts:
        raise TactileError(folder, "no recording that could be translated", "recordings", "See what was said above")
    _tell_copies(parts, asked.say)
    source = _joined(recipe, parts, aside, out)
    for layout in asked.layouts:
        _export(source, layout, out / layout, asked)
    with asked.bar("summary", "recording") as shown:
        summaries = survival.summarise(source, [*recipe.tasks, recipe.split.kept], shown)
    for task in recipe.tasks:
        if not any(task in one.told for one in summaries):
            asked.say(f"warning: no recording has the label {task!r}, which the recipe's tasks name")
    _write_words(recipe, named, found, source, summaries, out, asked)
    return source.aside


def _check_out(out: Path) -> None:
    """Raise TactileError if `out` cannot be written, or holds what is no data set of this program."""
    with atomic.writing(out):
        atomic.probe(out)
    if not (out / REPORT).exists() and not (out / JOBS).is_dir():
        for name in (CARD, PAGE, JOBS, UNITS):
            if (out / name).exists():
                raise TactileError(out / name, "there, and of no data set", "a new folder", "Name another --out")


def _counted(recipe: Recipe, found: Collected) -> list[str]:
    """Return sentences on the numbers of files to train and test with, and warnings that none is held out for testing,
    or that labels differ in case, or in how accents are written, alone."""
    splits = Counter(file.split for file in found.files)
    units = len(found.units())
    lines = [f"{len(found.files)} files of {units} units or hands: {splits[TRAIN]} train, {splits[TEST]} test"]
    if recipe.split.by and not splits[TEST]:
        wanted = f"values {', '.join(recipe.split.test)}" if recipe.split.test else "values one in five"
        lines.append(f"warning: nothing is held out for testing: no {recipe.split.by} among the {wanted}")
    elif absent := sorted({*recipe.split.test} - {file.labels.get(recipe.split.by, "") for file in found.files}):
        lines.append(f"warning: no recording has the {recipe.split.by} {', '.join(absent)}, which split.test holds out")
    if not splits[TRAIN]:
        lines.append("warning: nothing is left to train on: split.test names every recording")
    alike: dict[tuple[str, str], set[str]] = {}
    for name, text in (label for file in found.files for label in file.labels.items()):
        alike.setdefault((name, unicodedata.normalize("NFC", text).casefold()), set()).add(text)
    for (name, _), texts in alike.items():
        if len(texts) > 1:
            lines.append(f"warning: {name} {', '.join(sorted(texts))} are taken for different ones: rename the files")
    return lines


def _translated(
    recipe: Recipe, unit: str, files: list[File], sensor: SensorFile | None, out: Path, asked: Asked
) -> Finished:
    """Translate the recordings of a unit as a job, or resume that job; return the finished job. Raises TactileError for
    another job there."""
    paths = [file.path for file in files]
    place = out / JOBS / (file_name(unit) or ALL)
    with runs.opened(place, None):
        with asked.bar("reading", "file") as shown:
            listed = inputs.hashed(paths, shown)
        wanted = Translate(
            list(KEEP), "", prepare=recipe.prepare, sensor=sensor, target=asked.target, preset=asked.preset or "",
            answer=Answer(frames_apart=recipe.snapshots), every=recipe.every,
        )  # fmt: skip
        whole = translate_shards.completed(wanted, paths, asked.say, asked.weights, asked.calibration)
        job = jobs.make(listed, whole, asked.weights, asked.calibration)
        if not jobs.exists(place):
            jobs.write(place, job)
        elif jobs.read(place).id != job.id:
            found = "holds another job (other recordings, contents, options or version)"
            raise TactileError(place, found, "the same command that began it", "Name another --out folder")
        with asked.bar(f"translate {place.name}", "task") as shown:
            done = runs.run(place, job, asked.place(place), None, shown)
    if len(done.aside) == len(job.inputs):
        return Finished(place, job.id, (), {name: str(why) for name, why in done.aside.items()}, {})
    return finished_job.load(place)


def _tell_copies(parts: list[tuple[str, list[File], Finished]], say: Callable[[str], None]) -> None:
    """Say which files hold the same bytes. parts : (unit, its files, its job)"""
    alike: dict[str, dict[str, str]] = {}
    for _, files, done in parts:
        known = {str(file.path): f"{file.path} ({file.split})" for file in files}
        for one in jobs.read(done.folder).inputs:
            file = chosen(one.path).file
            alike.setdefault(one.sha256, {})[file] = known[file]
    for names in alike.values():
        if len(names) > 1:
            say(f"warning: {', '.join(names.values())} are one recording: take the copies out of the folder")


def _joined(
    recipe: Recipe, parts: list[tuple[str, list[File], Finished]], aside: dict[str, str], out: Path
) -> Finished:
    """Return the jobs of all units joined as one, with labels, recordings to train with first.
    parts : (unit, its files, its job); aside : recording -> why it is left out, is extended"""
    recordings: list[Recorded] = []
    warnings: dict[str, list[str]] = {}
    content = hashlib.sha256()
    for unit, files, done in parts:
        paths = {one.name: one.path for one in jobs.read(done.folder).inputs}
        known = {str(file.path): file for file in files}
        mark = f"{file_name(unit)}_" if len(parts) > 1 else ""
        for one in done.recordings:
            path = paths[one.name]
            file, section = known[chosen(path).file], chosen(path).section
            own = file.labels | ({} if section == "unit" else {"finger": section})
            labels = {name: np.full(one.frames, text, object) for name, text in own.items()}
            try:
                labels |= one.labels | _measured(recipe, path, file)
            except TactileError as error:
                labels |= one.labels
                warnings.setdefault(mark + one.name, []).append(str(error))
            recordings.append(dataclasses.replace(one, name=mark + one.name, labels=labels, split=file.split))
        aside |= {mark + name: why for name, why in done.aside.items()}
        for name, texts in done.warnings.items():
            warnings.setdefault(mark + name, []).extend(texts)
        content.update(done.id.encode())
    recordings.sort(key=lambda one: one.split == TEST)
    for one in recordings:
        told = {name: list(map(str, texts)) for name, texts in one.labels.items()}
        content.update(json.dumps([one.name, one.split, told], sort_keys=True).encode())
    content.update(json.dumps(aside, sort_keys=True).encode())
    return Finished(out, content.hexdigest(), tuple(recordings), aside, warnings)


def _measured(recipe: Recipe, path: str, file: File) -> dict[str, np.ndarray]:
    """Return labels by frame, name -> (T,) texts: the force, N, in a file beside the recording, and columns of its own
    file, as the recipe names them. path : of the recording, with its finger"""
    found: dict[str, np.ndarray] = {}
    measured = beside(file.path.parent, recipe.force, file) if recipe.force else None
    if measured is not None and measured.is_file():
        recording = read(path, recipe.prepare.columns)
        times, sizes = read_force(str(measured), recording)
        found[FORCE] = np.interp(recording.time, times, sizes, left=np.nan, right=np.nan)
    if recipe.values:
        found |= dict(zip(recipe.values, read_columns(str(file.path), recipe.values).T, strict=True))
    return {
        name: np.array([f"{value:.4g}" if np.isfinite(value) else "" for value in values[:: recipe.every]], object)
        for name, values in found.items()
    }


def _export(source: Finished, layout: str, out: Path, asked: Asked) -> None:
    """Write a layout to `out`, unless it is there, made from this job. Only a folder of the same layout is replaced."""
    try:
        held = json.loads(read_small(out / export.NOTE))
        if held["job"] == source.id:
            return
        ours = held["layout"] == layout
    except (OSError, ValueError, KeyError, TypeError):
        ours = False
    with asked.bar(f"write {layout}", "frame") as shown:
        export.write(source, layout, out, shown, overwrite=ours)


def _write_words(
    recipe: Recipe, named: str, found: Collected, source: Finished, summaries: list[survival.Summary], out: Path,
    asked: Asked,
) -> None:  # fmt: skip
    """Write card, page and report; how much of the labels survives is measured if scikit-learn is installed.
    named : the recipe's name or file, as the user gave it"""
    rows: list[survival.Row] | None = None
    if survival.installed():
        with asked.bar("what survives", "step") as shown:
            rows = [row for task in recipe.tasks for row in survival.rows(task, summaries, recipe.split.kept, shown)]
    text = dataset_card.card_of(recipe, named, found, source, summaries, rows, asked.layouts)
    with atomic.writing(out):
        atomic.write_bytes(out / CARD, text.encode())
        with asked.bar("page", "recording") as shown:
            atomic.write_bytes(out / PAGE, dataset_card.page_of(recipe, summaries, shown).encode())
        told = [row.numbers() for row in rows or ()]
        atomic.write_json(out / REPORT, {"recordings": [one.numbers() for one in summaries], "survival": told})
