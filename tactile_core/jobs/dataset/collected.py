"""Find the recordings in a data set's folder, with the labels in their names and their part (train or test); and
calibrate their units by those that can be read."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ...errors import TactileError
from ...files import atomic
from ...files.outside import read_small
from ...files.version import __version__
from ...recordings import electrode_gains, read, readers
from ...recordings.electrode_gains import SensorFile
from ...sensors import title
from ...translation import adapt, networks, reference_signals
from ..engine import inputs
from ..engine.inputs import content_hash
from .recipe import FIELD, Recipe, filled

TRAIN, TEST = "train", "test"
UNFIT = re.compile(r"[^A-Za-z0-9_-]")  # of a unit's name in that of its files
HELD_OUT = 5  # one value in so many is for testing where the recipe names none (assumed)


@dataclass(frozen=True)
class File:
    """Recording file of a data set. labels : name -> value, from the file's name; split : "train" or "test"
    unit : value of the label that tells units apart, "" if the recipe names none"""

    path: Path
    unit: str
    labels: dict[str, str]
    split: str


@dataclass(frozen=True)
class Collected:
    """Files of a data set, sorted by path. others : number that fits no pattern; unfit : path -> why it is left out"""

    files: tuple[File, ...]
    others: int
    unfit: dict[str, str]

    def units(self) -> dict[str, list[File]]:
        """Return the files of each unit, by the unit's name."""
        found: dict[str, list[File]] = {}
        for file in self.files:
            found.setdefault(file.unit, []).append(file)
        return found


def collect(recipe: Recipe, folder: Path, out: Path) -> Collected:
    """Return a recipe's files in a folder, without linked or hidden folders and `out`. Raises TactileError for none."""
    if not folder.is_dir():
        raise TactileError(folder, "no folder", "the folder of the data set")
    patterns = [_compiled(pattern) for pattern in recipe.files]
    aside = [_compiled(name) for name in (recipe.unit.rest, recipe.force) if name]
    folder = Path(os.path.abspath(folder))  # as jobs name their inputs
    if folder.resolve().is_relative_to(out.resolve()):
        raise TactileError(folder, f"inside --out {out}", "a folder outside of it", "Name another --out")
    names = [name for name in _names(folder) if not (folder / name).resolve().is_relative_to(out.resolve())]
    found, others, unfit = [], 0, {}
    for name in names:
        if any(pattern.fullmatch(name) for pattern in aside):
            continue
        fits = next((fit for pattern in patterns if (fit := pattern.fullmatch(name))), None)
        if fits is None:
            others += 1
            continue
        shown = name.encode(errors="backslashreplace").decode()
        if shown != name:
            unfit[shown] = f"{folder / shown}: a name that is no UTF-8; expected one that a table can hold. Rename it"
            continue
        labels = fits.groupdict()
        unit = labels.get(recipe.unit.by, "")
        found.append(File(folder / name, unit, labels, _split(recipe, labels)))
    if not found:
        held = f"{len(names)} files, such as {names[0]}" if names else "no file"
        expected = " or ".join(recipe.files)
        raise TactileError(folder, held, expected, "Is it the folder of another data set? `tactile dataset` lists them")
    return Collected(tuple(found), others, unfit)


def _names(folder: Path) -> list[str]:
    """Return the paths of all files below a folder, relative to it, sorted, without hidden ones."""
    found = []
    for place, folders, names in os.walk(folder, onerror=inputs.passed_over):
        folders[:] = [name for name in folders if not name.startswith(".")]
        found += [Path(place, name).relative_to(folder).as_posix() for name in names if not name.startswith(".")]
    return sorted(found)


def _compiled(pattern: str) -> re.Pattern[str]:
    """Return a recipe's pattern of paths, at any depth of folders, as a regular expression; a {label} matches no /."""
    parts = FIELD.split(pattern)
    text, held = re.escape(parts[0]), set()
    for field, after in zip(parts[1::2], parts[2::2], strict=True):
        text += (f"(?P={field})" if field in held else f"(?P<{field}>[^/]+)") + re.escape(after)
        held.add(field)
    return re.compile(f"(?:.*/)?{text}", re.DOTALL)


def _split(recipe: Recipe, labels: dict[str, str]) -> str:
    """Return "train" or "test" for a recording's labels, as the recipe says, or by a hash of the label's value."""
    if recipe.split.by not in labels:
        return TRAIN
    value = labels[recipe.split.by]
    if recipe.split.test:
        return TEST if value in recipe.split.test else TRAIN
    return TEST if int(hashlib.sha256(value.encode()).hexdigest(), 16) % HELD_OUT == 0 else TRAIN


def beside(folder: Path, name: str, file: File) -> Path:
    """Return the path of a file, existing or not. name : its path from the folder of the recording `file`, with {label}
    Raises TactileError if it is outside the data set's folder, and for a label that the recording lacks."""
    path = file.path.parent / filled(name, file.labels)
    if not path.resolve().is_relative_to(folder.resolve()):
        raise TactileError(path, "outside the data set's folder", "a file inside it")
    return path


def file_name(unit: str) -> str:
    """Return the name of a unit's files without ending: the unit's name if plain, else made so, with a hash."""
    plain = UNFIT.sub("_", unit)[:60]
    return plain if plain == unit else f"{plain}-{hashlib.sha256(unit.encode()).hexdigest()[:8]}"


def readable(recipe: Recipe, files: list[File]) -> tuple[list[File], dict[str, str]]:
    """Return readable files of the recipe's sensor, and path -> why others are not; read whole if units are adapted."""
    good, aside = [], {}
    for file in files:
        path = str(file.path)
        try:
            content_hash(file.path)
            found = readers.sensor_of(path, recipe.prepare.columns)
            if found != recipe.sensor:
                expected = f"one of a {title(recipe.sensor)}, as the recipe says"
                raise TactileError(path, f"a recording of a {title(found)}", expected)
            for finger in readers.each_finger(path, recipe.prepare.columns):
                if recipe.unit.found == "adapt":
                    read(finger, recipe.prepare.columns, recipe.sensor)
        except TactileError as error:
            aside[path] = str(error)
        else:
            good.append(file)
    return good, aside


def calibrated(
    recipe: Recipe, files: list[File], folder: Path, out: Path, weights: str | None, say: Callable[[str], None]
) -> SensorFile | None:
    """Return a unit's calibration, found as the recipe says; None if each recording is treated by itself.
    folder : the data set's; weights : folder of networks, None for those that ship; say : called with sentences
    out : file that keeps the calibration, reused for the same recordings, rest, weights and recipe
    Raises TactileError for a rest that is missing or differs between files, and if none is found."""
    how = recipe.unit
    if how.found == "none":
        return None
    rest = _rest(recipe, files, folder)
    sources = [*([] if rest is None else [rest]), *([] if how.found == "rest" else [file.path for file in files])]
    content = [how.found, repr(recipe.prepare), weights, __version__, [content_hash(path)[0] for path in sources]]
    made_from = hashlib.sha256(json.dumps(content).encode()).hexdigest()
    note = out.with_suffix(".json")
    with suppress(OSError, ValueError, KeyError, TypeError):  # there is none, or not a whole one
        if json.loads(read_small(note))["made_from"] == made_from:
            return electrode_gains.read(out)
    say(f"finding the unit of {len(files)} files")
    if how.found == "rest":
        sensor = adapt.rest_unit(str(rest), recipe.prepare.columns)
    else:
        typical = reference_signals.read(weights or networks.WEIGHTS_FOLDER)
        given = None if rest is None else str(rest)
        paths = [str(file.path) for file in files]
        sensor, warnings = adapt.adapt_hand(paths, typical, recipe.prepare.options(), given)
        for warning in warnings:
            say(f"warning: {warning}")
    electrode_gains.check(sensor, out)
    with atomic.writing(out):
        electrode_gains.write(out, sensor)
        atomic.write_json(note, {"made_from": made_from})
    return electrode_gains.read(out)  # as the next run reads it, rounded


def _rest(recipe: Recipe, files: list[File], folder: Path) -> Path | None:
    """Return the recording of the untouched finger, None if the recipe names none; TactileError if it is missing."""
    if not recipe.unit.rest:
        return None
    found = sorted({beside(folder, recipe.unit.rest, file) for file in files})
    if len(found) > 1:
        expected, advice = "one rest for all recordings of a unit", "Let unit.by name the label that tells units apart"
        raise TactileError(found[1], f"a rest beside {found[0]}, of one unit", expected, advice)
    if not found[0].is_file():
        expected = f"the untouched finger, which the recipe names for {files[0].path.name}"
        raise TactileError(found[0], "missing", expected)
    return found[0]
