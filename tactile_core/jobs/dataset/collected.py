"""Find the recordings in a data set's folder, with the labels in their names, and their part (train or test)."""

from __future__ import annotations

import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path

from ...errors import TactileError
from ..engine import inputs
from .recipe import FIELD, Recipe, filled

TRAIN, TEST = "train", "test"
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
    real, own = os.path.realpath, os.path.realpath(out)  # of links in a circle, too
    if Path(real(folder)).is_relative_to(own):
        raise TactileError(folder, f"inside --out {out}", "a folder outside of it", "Name another --out")
    names = [name for name in _names(folder) if not Path(real(folder / name)).is_relative_to(own)]
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
    for place, _, names in inputs.walked(folder):
        found += [Path(place, name).relative_to(folder).as_posix() for name in names]
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
