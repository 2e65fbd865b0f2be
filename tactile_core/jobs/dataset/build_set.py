"""A data set from beginning to end: units, a job of translations each, then layouts, card and page."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import util
from pathlib import Path

import numpy as np

from ...errors import TactileError
from ...files import atomic
from ...files.outside import read_small
from ...recordings import electrode_gains, read
from ...recordings.electrode_gains import SensorFile
from ...recordings.force_file import read_columns, read_force
from ...recordings.recording import split as chosen
from ...sensors import TARGET
from ...translation import adapt, networks, reference_signals
from ...translation.answer import Answer
from .. import export, translate_recipe
from ..engine import inputs
from ..engine import job as jobs
from ..engine import run as runs
from ..export import finished_job
from ..export.finished_job import Finished, Recorded
from . import dataset_card, dataset_page, summary, survival
from .collected import TEST, Collected, File, beside, collect
from .recipe import Recipe

CARD, PAGE, UNITS, JOBS, REPORT = "README.md", "index.html", "units", "jobs", "dataset.json"
FORCE = "measured_force_n"
KEEP = ("latent", "image")

Bar = Callable[[str, str], AbstractContextManager[Callable[[int, int], None]]]


@dataclass(frozen=True)
class Asked:
    """Options of a data set. layouts : names of ``export.layouts``; place : executor of a job's tasks in its folder

    say : told sentences; bar : (name, unit) -> context of a callback (done, in all)
    """

    layouts: Sequence[str]
    place: Callable[[Path], runs.Place]
    say: Callable[[str], None]
    bar: Bar
    target: str = TARGET
    preset: str | None = None
    calibration: str | None = None
    weights: str | None = None


def build(recipe: Recipe, named: str, folder: Path, out: Path, asked: Asked) -> dict[str, str]:
    """Make the data set `out` of the recordings in a folder; what is there already is kept.

    Returns what was set aside, and why. Raises TactileError for another set's folder, a unit whose rest is missing,
    and a disk that cannot be written.
    """
    found = collect(recipe, folder, out)
    held = {"train": 0, TEST: 0}
    for file in found.files:
        held[file.split] += 1
    units = len(found.units())
    asked.say(f"{len(found.files)} files of {units} units or hands: {held['train']} train, {held[TEST]} test")
    parts, aside = [], {}
    for unit, files in found.units().items():
        try:
            parts.append(_translated(recipe, unit, files, folder, out, asked))
        except TactileError as error:
            if error.where and str(error.where).startswith(str(out)):
                raise
            aside[unit or folder.name] = str(error)
            asked.say(f"set aside: {error}")
    if not parts:
        raise TactileError(folder, "no recording that could be translated", "recordings", "See what was said above")
    source = _joined(recipe, parts, aside, out)
    for layout in asked.layouts:
        _export(source, layout, out / layout, asked)
    with asked.bar("summary", "recording") as shown:
        summaries = summary.summarise(source, [*recipe.tasks, recipe.split.kept], shown)
    _write_words(recipe, named, found, source, summaries, out, asked)
    return source.aside


def _translated(
    recipe: Recipe, unit: str, files: list[File], folder: Path, out: Path, asked: Asked
) -> tuple[str, list[File], Finished]:
    """Find the unit and translate its recordings as a job, or go on with it."""
    name = unit or "all"
    paths = [file.path for file in files]
    sensor = _unit(recipe, files, folder, out / UNITS / f"{name}.toml", asked)
    place = out / JOBS / name
    want = translate_recipe.Asked(
        KEEP, recipe.prepare, sensor, asked.weights, asked.calibration, asked.target, asked.preset,
        Answer(frames_apart=recipe.snapshots),
        every=recipe.every,
    )  # fmt: skip
    with runs.opened(place, None):
        with asked.bar("reading", "file") as shown:
            listed = inputs.hashed(paths, shown)
        job = jobs.make(listed, translate_recipe.make(want, paths, asked.say), asked.weights, asked.calibration)
        if not jobs.exists(place):
            jobs.write(place, job)
        elif jobs.read(place).id != job.id:
            found = "holds another job (other recordings, contents or options)"
            raise TactileError(place, found, "the same command that began it", "Name another --out folder")
        with asked.bar(f"translate {name}", "task") as shown:
            done = runs.run(place, job, asked.place(place), None, shown)
    if len(done.aside) == len(job.inputs):
        raise TactileError(name, str(next(iter(done.aside.values()))), "recordings that can be translated")
    return unit, files, finished_job.load(place)


def _unit(recipe: Recipe, files: list[File], folder: Path, out: Path, asked: Asked) -> SensorFile | None:
    """Return the unit's calibration, found as the recipe says, and keep it as a file; None for each by itself."""
    how = recipe.unit
    if how.found == "none":
        return None
    if out.exists():
        return electrode_gains.read(out)
    rest = beside(folder, how.rest, files[0]) if how.rest else None
    if rest is not None and not rest.is_file():
        raise TactileError(rest, "missing", f"the untouched finger, which the recipe names for {files[0].path.name}")
    asked.say(f"finding the unit of {len(files)} files")
    if how.found == "rest":
        sensor = adapt.rest_unit(str(rest), recipe.columns)
    else:
        typical = reference_signals.read(asked.weights or networks.WEIGHTS_FOLDER)
        given = None if rest is None else str(rest)
        paths = [str(file.path) for file in files]
        sensor, warnings = adapt.adapt_hand(paths, typical, recipe.prepare.options(), given)
        for warning in warnings:
            asked.say(f"warning: {warning}")
    electrode_gains.check(sensor, out)
    electrode_gains.write(out, sensor)
    return electrode_gains.read(out)  # as the next run reads it, rounded


def _joined(
    recipe: Recipe, parts: list[tuple[str, list[File], Finished]], aside: dict[str, str], out: Path
) -> Finished:
    """Put the jobs of all units together as one, labelled; train comes before test."""
    recordings: list[Recorded] = []
    warnings: dict[str, list[str]] = {}
    for unit, files, done in parts:
        paths = {one.name: one.path for one in jobs.read(done.folder).inputs}
        known = {str(file.path.resolve()): file for file in files}
        mark = f"{unit}_" if len(parts) > 1 else ""
        for one in done.recordings:
            path = paths[one.name]
            file = known[str(Path(chosen(path).file).resolve())]
            labels = {name: np.full(one.frames, text, object) for name, text in _labels(path, file).items()}
            labels |= one.labels | _measured(recipe, path, file)
            recordings.append(dataclasses.replace(one, name=mark + one.name, labels=labels, split=file.split))
        aside |= {mark + name: why for name, why in done.aside.items()}
        warnings |= {mark + name: texts for name, texts in done.warnings.items()}
    recordings.sort(key=lambda one: one.split == TEST)
    content = json.dumps([[done.id for _, _, done in parts], [[one.name, one.split] for one in recordings]])
    ident = hashlib.sha256(content.encode()).hexdigest()
    return Finished(out, ident, tuple(recordings), aside, warnings)


def _labels(path: str, file: File) -> dict[str, str]:
    """Labels of a recording from its file's name, and which finger of a hand it is."""
    section = chosen(path).section
    return file.labels | ({} if section == "unit" else {"finger": section})


def _measured(recipe: Recipe, path: str, file: File) -> dict[str, np.ndarray]:
    """Numbers measured beside a recording, a text a frame: force in N where its file is there, columns of its own."""
    found: dict[str, np.ndarray] = {}
    measured = beside(file.path.parent, recipe.force, file) if recipe.force else None
    if measured is not None and measured.is_file():
        recording = read(path, recipe.columns)
        times, sizes = read_force(str(measured), recording)
        found[FORCE] = np.interp(recording.time, times, sizes, left=np.nan, right=np.nan)
    if recipe.values:
        found |= dict(zip(recipe.values, read_columns(str(file.path), recipe.values).T, strict=True))
    return {
        name: np.array([f"{value:.4g}" if np.isfinite(value) else "" for value in values[:: recipe.every]], object)
        for name, values in found.items()
    }


def _export(source: Finished, layout: str, out: Path, asked: Asked) -> None:
    """Write a layout, unless it is there of these recordings."""
    try:
        if json.loads(read_small(out / export.NOTE))["job"] == source.id:
            return
    except (OSError, ValueError, KeyError, TypeError):
        pass  # not there, or not whole: made
    with asked.bar(f"write {layout}", "frame") as shown:
        export.write(source, layout, out, shown, overwrite=True)


def _write_words(
    recipe: Recipe, named: str, found: Collected, source: Finished, summaries: list[summary.Summary], out: Path,
    asked: Asked,
) -> None:  # fmt: skip
    """Write the card, the page and their numbers."""
    rows: list[survival.Row] | None = None
    if util.find_spec("sklearn"):
        with asked.bar("what survives", "step") as shown:
            rows = [row for task in recipe.tasks for row in survival.rows(task, summaries, recipe.split.kept, shown)]
    text = dataset_card.written(recipe, named, found, source, summaries, rows, asked.layouts)
    with atomic.writing(out):
        atomic.write_bytes(out / CARD, text.encode())
        with asked.bar("page", "recording") as shown:
            atomic.write_bytes(out / PAGE, dataset_page.written(recipe, summaries, shown).encode())
        told = [row.numbers() for row in rows or ()]
        atomic.write_json(out / REPORT, {"recordings": [one.numbers() for one in summaries], "survival": told})
