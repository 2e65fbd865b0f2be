"""Table of speed against error in docs/accuracy.md, written from the results of a whole run."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from tactile_core.errors import TactileError
from tactile_core.files import atomic

from .method import Method

HEADER = "| stage | method | ms a frame | peak MB | error | baseline |\n|---|---|---|---|---|---|"
# Stage, what the method is called, and its name as it begins in the rows.
LINES = (
    ("contact, DIGIT", "fast tier", "mechanics digit_fast"),
    ("", "full tier", "mechanics digit_full"),
    ("", "reference tier", "mechanics digit_reference"),
    ("contact, BioTac", "fast tier", "mechanics biotac_fast"),
    ("", "full tier", "mechanics biotac_full"),
    ("", "reference tier", "mechanics biotac_reference"),
    ("signals → DIGIT gel", "ours, one frame", "translation numpy_1"),
    ("", "ours, 500 at once", "translation numpy_500"),
    ("picture of a known gel", "fast", "pictures fast"),
    ("", "standard", "pictures standard"),
    ("", "quality", "pictures quality"),
    ("", "reference", "pictures reference"),
    ("picture against photographs", "fast", "photographs fast"),
    ("", "quality", "photographs quality"),
    ("", "a table after Taxim", "photographs taxim_like"),
    ("signals → picture", "fast", "chain fast"),
)
PLACE = re.compile(re.escape(HEADER) + r"\n(?:\|.*\n)+")


def write_summary(path: Path, methods: Sequence[Method]) -> None:
    """Put the table of these methods in the place of the one in the file.

    Raises TactileError where the file has no such table.
    """
    text = path.read_text(encoding="utf-8")
    if len(PLACE.findall(text)) != 1:
        raise TactileError(path, "not one table of speed and error", "one with these columns: " + HEADER.split("\n")[0])
    atomic.write_bytes(path, PLACE.sub(lambda _: table(methods), text).encode())


def table(methods: Sequence[Method]) -> str:
    """Return the table as Markdown, without lines whose methods were left out."""
    lines, stage = [HEADER], ""
    for begins, label, name in LINES:
        stage = begins or stage
        for each in methods:
            if named(each, name):
                errors = [f"{short(value)} {each.unit.replace('um', 'µm')}" for value in (each.error, each.baseline)]
                lines.append("| " + " | ".join([stage, label, short(each.ms), short(each.mb), *errors]) + " |")
    return "\n".join(lines) + "\n"


def named(method: Method, name: str) -> bool:
    """Return true if the method has this name; pictures' names end in the variant of Mitsuba that drew them."""
    return f"{method.stage} {re.sub('_(llvm|scalar|cuda)_.*', '', method.name)}" == name


def short(value: float | None) -> str:
    """Format with two digits, hundreds whole."""
    return "-" if value is None else f"{float(f'{value:.2g}'):,.0f}" if value >= 10 else f"{value:.2g}"
