"""Read the recipe of a data set, a TOML file: which files of a folder are recordings, of which units, with which
labels; or guess one from the names of a user's files, with advice on what to fill in."""

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from ...errors import TactileError
from ...files import atomic
from ...files.outside import read_toml_text, toml_quoted
from ...files.shipped import shipped
from ...sensors import SOURCE
from ..engine import inputs
from ..engine.job import Prepare
from ..export.formats.imagefolder import NUMBERS

FORMAT = "tactile-dataset-1"
SHIPPED = "datasets"
FIELD = re.compile(r"\{(\w+)\}")
MOST_FIELDS = 8  # of a pattern: each may stretch over a name, and their work multiplies (assumed enough)
FORCE = "measured_force_n"  # label of the force beside a recording
# What is no label's name: columns of the results and choices of the page.
OWN = {"finger", "recording", "frame", "time", "file_name", "split", "flag", "flags", FORCE, *NUMBERS}
ADVICE = "See `tactile dataset --help`"

Pattern = Annotated[str, Meta(min_length=1, max_length=300)]
BETWEEN = re.compile(r"[_\-./ ]")  # pieces of names
# -1.5 is one piece; of 2024.01.05 and run.1.2, whose dots stand between names, each number is
PIECE = re.compile(r"(?<![^_\-/ ])-?\d+\.\d+(?![^_\-./ ]|\.\d)|(?<![^_\-./ ])-?\d+(?![^_\-./ ])|[^_\-./ ]+|[_\-./ ]")
MOST_PATTERNS = 8  # shapes of names, the commonest (assumed enough)

TEMPLATE = """\
# Recipe of a data set, guessed from {count} recordings: check it. `tactile dataset --help` says what is made of it.
format = "{format}"
# Paths of the recordings below the folder, at any depth; what stands for {{label}} in a name becomes that label.
# {examples}
files = [{files}]
tasks = []  # labels worth telling, which the card measures: {labels}
every = 1  # translate one in so many frames
notes = []  # what a reader of the card must know first

[source]
title = {title}
url = ""
citation = ""
licence = "not stated"

[prepare]
# polarity = "falls"  # raw counts fall where a film thins; "rises" for rest minus reading
# tare = "0:100"  # frames without contact, if all recordings begin with them

# [prepare.columns]  # of files in no known layout: the lines that `tactile info FILE --columns map.toml` writes

[unit]
# adapt: rest, gains and film from all recordings; rest: its rest alone, from a file, rest = "..."; none: each by itself
found = "{found}"
# by = ""  # label whose values are units of their own

[split]
by = ""  # label whose values stay together in train or test
# test = []  # its values for testing; without them one in five
"""


class Unit(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """How the units of a data set are calibrated.

    by : name of the label whose values are units; "" if all recordings are of one unit, or one hand
    found : "adapt" estimates rest, gains and film from all recordings of the unit; "rest" reads its rest from the file
        `rest`; "none" treats each recording by itself
    rest : path of a recording of the untouched finger, in which {label} stands for the label's value"""

    by: str = ""
    found: Literal["adapt", "rest", "none"] = "none"
    rest: str = ""


class Split(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Division into train and test, by a label whose values stay together.
    by : name of that label, "" if all are for training; test : its values held out, empty for one value in five
    apart : label of frames whose values the card's classifiers hold out together, `by` if empty"""

    by: str = ""
    test: list[str] = []
    apart: str = ""

    @property
    def kept(self) -> str:
        """Return the name of the label whose values the card's classifiers hold out together; "" for none."""
        return self.apart or self.by


class Source(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Origin of the data, in words for the card. licence : as stated, and where"""

    title: str
    url: str = ""
    citation: str = ""
    licence: str = "not stated: ask the authors before you pass anything on"


class Recipe(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Recipe of a data set.

    files : patterns of paths below the folder, at any depth, of which the first that fits counts; {label} in one stands
        for any text, which becomes the label's value
    format : "tactile-dataset-1"; sensor : name of the recorded sensor, "biotac" or "biotac_sp"
    tasks : names of labels to learn; values : names of columns of numbers in the files, which become labels, too
    force : path of a file of newtons beside a recording, with {label}, used if it exists; "" for none
    every : translate one frame in ``every``; snapshots : true if frames do not follow each other in time
    notes : first lines of the card"""

    format: str
    source: Source
    files: Annotated[list[Pattern], Meta(min_length=1)]
    sensor: str = SOURCE
    tasks: list[str] = []
    force: str = ""
    values: list[str] = []
    every: Annotated[int, Meta(ge=1)] = 1
    snapshots: bool = False
    notes: list[str] = []
    prepare: Prepare = Prepare()
    unit: Unit = Unit()
    split: Split = Split()


def known() -> dict[str, Path]:
    """Return the recipes that ship, name -> file."""
    return {file.stem: file for file in sorted(shipped(SHIPPED).glob("*.toml"))}


def read(named: str) -> Recipe:
    """Return a recipe, by the name of one that ships or a TOML file's path. Raises TactileError with file and field."""
    file = known().get(named, Path(named))
    try:
        found = msgspec.toml.decode(read_toml_text(file), type=Recipe)
    except OSError as error:
        expected = f"{', '.join(known())}, or a recipe's file"
        advice = "`tactile dataset` lists them"
        raise TactileError(named, f"no data set ({error.strerror})", expected, advice) from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "a recipe of a data set", ADVICE) from error
    _check(found, file)
    return found


def _check(recipe: Recipe, file: Path) -> None:
    if recipe.format != FORMAT:
        raise TactileError(f"{file}, format", repr(recipe.format), repr(FORMAT), ADVICE)
    for field, names in (("files", recipe.files), ("unit.rest", [recipe.unit.rest]), ("force", [recipe.force])):
        for name in names:
            if Path(name).is_absolute() or ".." in Path(name).parts:
                raise TactileError(f"{file}, {field}", repr(name), "a path inside the data set's folder")
    labels = {label for pattern in recipe.files for label in FIELD.findall(pattern)}
    for pattern in recipe.files:
        held = FIELD.findall(pattern)
        bad = set(held) & OWN or {name for name in held if not name.isidentifier()}
        if len(held) > MOST_FIELDS or len(set(held)) < len(held) or bad:
            expected = f"at most {MOST_FIELDS} different labels, named as in Python, none of {', '.join(sorted(OWN))}"
            raise TactileError(f"{file}, files", repr(pattern), expected)
    if set(recipe.values) & OWN:
        expected = f"columns of the recordings, none of {', '.join(sorted(OWN))}"
        raise TactileError(f"{file}, values", ", ".join(recipe.values), expected)
    strange = set(FIELD.findall(recipe.unit.rest)) - {recipe.unit.by}
    if strange:
        advice = "Let unit.by name the label that tells units apart"
        raise TactileError(f"{file}, unit.rest", repr(recipe.unit.rest), "no label but unit.by's", advice)
    for field, name in (("unit.by", recipe.unit.by), ("split.by", recipe.split.by)):
        if name and name not in labels:
            expected = f"a label of files: {', '.join(sorted(labels)) or 'none'}"
            raise TactileError(f"{file}, {field}", repr(name), expected)
    if (recipe.unit.found == "rest") != bool(recipe.unit.rest) and recipe.unit.found != "adapt":
        raise TactileError(f"{file}, unit", f"found {recipe.unit.found!r}, rest {recipe.unit.rest!r}", "both or none")
    recipe.prepare.options().check()


def filled(name: str, labels: dict[str, str]) -> str:
    """Return a file's name with its {label}s replaced by values. Raises TactileError for a label that is not given."""
    for label in FIELD.findall(name):
        if label not in labels:
            raise TactileError(name, f"{{{label}}}, which is no label", ", ".join(labels) or "no label", ADVICE)
    return FIELD.sub(lambda found: labels[found[1]], name)


def write(out: Path, folder: Path) -> None:
    """Write a guessed recipe for the recordings in a folder to the new file `out`. Raises TactileError for none."""
    atomic.claim(out)
    if not folder.is_dir():
        raise TactileError(folder, "no folder", "a folder of recordings")
    paths = [path.relative_to(folder.resolve()).as_posix() for path in inputs.find([str(folder)], out)]
    patterns = _patterns(paths)
    labels = sorted({label for pattern in patterns for label in re.findall(r"\{(\w+)\}", pattern)})
    text = TEMPLATE.format(
        count=len(paths), format=FORMAT, examples=" ".join(toml_quoted(path) for path in paths[:3]),
        files=", ".join(toml_quoted(pattern) for pattern in patterns), labels=", ".join(labels) or "none found",
        title=toml_quoted(folder.resolve().name), found="adapt" if len(paths) > 2 else "none",
    )  # fmt: skip
    atomic.write_bytes(out, text.encode())


def _patterns(paths: list[str]) -> list[str]:
    """Return guessed patterns of paths, the commonest first: in names of one shape, parts that differ are labels."""
    alike: dict[tuple[str, ...], list[list[str]]] = {}
    for path in paths:
        stem, ending = os.path.splitext(path)
        pieces = PIECE.findall(stem)
        alike.setdefault((ending, *(piece if BETWEEN.fullmatch(piece) else "" for piece in pieces)), []).append(pieces)
    commonest = sorted(alike.items(), key=lambda shape: -len(shape[1]))[:MOST_PATTERNS]
    return [_pattern(names) + ending for (ending, *_), names in commonest]


def _pattern(names: list[list[str]]) -> str:
    """Return the pattern of names cut into equally many parts: those that differ become {label1}, {label2} ..."""
    fields = (f"{{label{number}}}" for number in itertools.count(1))
    columns = list(zip(*names, strict=True))
    varied = [column for column in columns if len(set(column)) > 1]
    kept = varied[-MOST_FIELDS:]  # folders above vary least
    return "".join(next(fields) if column in kept else column[0] for column in columns)
