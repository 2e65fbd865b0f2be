"""Guess a recipe for one's own data set from the names of its files, with advice on what to fill in."""

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path

from ...errors import TactileError
from ...files import atomic
from ...files.outside import toml_quoted
from ..engine import inputs
from .recipe import FORMAT, MOST_FIELDS

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


def write(out: Path, folder: Path) -> None:
    """Write a recipe for the recordings in a folder to the new file `out`. TactileError for a folder without any."""
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
    """Guess patterns of paths, the commonest first: in names of the same shape, the parts that differ become labels."""
    alike: dict[tuple[str, ...], list[list[str]]] = {}
    for path in paths:
        stem, ending = os.path.splitext(path)
        pieces = PIECE.findall(stem)
        alike.setdefault((ending, *(piece if BETWEEN.fullmatch(piece) else "" for piece in pieces)), []).append(pieces)
    commonest = sorted(alike.items(), key=lambda shape: -len(shape[1]))[:MOST_PATTERNS]
    return [_pattern(names) + ending for (ending, *_), names in commonest]


def _pattern(names: list[list[str]]) -> str:
    """Return the pattern of names that are cut into equally many parts."""
    fields = (f"{{label{number}}}" for number in itertools.count(1))
    columns = list(zip(*names, strict=True))
    varied = [column for column in columns if len(set(column)) > 1]
    kept = varied[-MOST_FIELDS:]  # folders above vary least
    return "".join(next(fields) if column in kept else column[0] for column in columns)
