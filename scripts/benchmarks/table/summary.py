"""Table of speed against error in docs/accuracy.md, written from the results of a whole run."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from tactile_core.errors import TactileError
from tactile_core.files import atomic

from .method import Method

HEADER = "| stage | method | ms a frame | peak MB | error | baseline |\n|---|---|---|---|---|---|"
# Stage, what the methods are called, and their names as they begin in the rows.
LINES = (
    ("contact, DIGIT", "fast / full / reference tier", ("mechanics digit_fast", "mechanics digit_full",
                                                        "mechanics digit_reference")),
    ("contact, BioTac", "fast / full / reference tier", ("mechanics biotac_fast", "mechanics biotac_full",
                                                         "mechanics biotac_reference")),
    ("signals → DIGIT gel", "ours, one frame / 500 at once", ("translation numpy_1", "translation numpy_500")),
    ("the same, fewer pairs, equal training time", "ours / networks of ACROSS's shapes",
     ("translation numpy_same_pairs_1", "translation across_1")),
    ("picture of a known gel", "fast / standard / quality / reference",
     ("pictures fast", "pictures standard", "pictures quality", "pictures reference")),
    ("picture against photographs", "fast / quality / a table after Taxim",
     ("photographs fast", "photographs quality", "photographs taxim_like")),
    ("signals → picture", "fast", ("chain fast",)),
)  # fmt: skip
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
    lines = [HEADER]
    for stage, label, names in LINES:
        found = [each for name in names for each in methods if named(each, name)]
        if len(found) == len(names):
            cells = [joined(found, lambda one: one.ms), joined(found, lambda one: one.mb)]
            cells += [
                f"{joined(found, lambda one: one.error)} {unit(found)}",
                f"{short(found[0].baseline)} {unit(found)}",
            ]
            lines.append("| " + " | ".join([stage, label, *cells]) + " |")
    return "\n".join(lines) + "\n"


def named(method: Method, name: str) -> bool:
    """Return true if the method has this name; pictures' names end in the variant of Mitsuba that drew them."""
    return f"{method.stage} {re.sub('_(llvm|scalar|cuda)_.*', '', method.name)}" == name


def joined(methods: Sequence[Method], of: Callable[[Method], float | None]) -> str:
    """Join the numbers of all methods, once where they read alike."""
    texts = [short(of(method)) for method in methods]
    return texts[0] if len(set(texts)) == 1 else " / ".join(texts)


def short(value: float | None) -> str:
    """Format with two digits, hundreds whole."""
    return "-" if value is None else f"{float(f'{value:.2g}'):,.0f}" if value >= 10 else f"{value:.2g}"


def unit(methods: Sequence[Method]) -> str:
    """Unit of the methods' errors."""
    return methods[0].unit.replace("um", "µm")
