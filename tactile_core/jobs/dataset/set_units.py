"""Find a data set's readable files, and calibrate its units by them."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ...errors import TactileError
from ...files import atomic
from ...files.outside import read_small
from ...files.version import __version__
from ...recordings import electrode_gains, read, readers
from ...recordings.electrode_gains import SensorFile
from ...sensors import title
from ...translation import adapt, networks, reference_signals
from ..engine.inputs import content_hash
from .collected import File, beside
from .recipe import Recipe

UNFIT = re.compile(r"[^A-Za-z0-9_-]")  # of a unit's name in that of its files


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
