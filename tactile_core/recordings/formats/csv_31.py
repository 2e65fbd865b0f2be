"""CSV of 31 columns: time, position (3), force (3), pac0, pac1, pdc, tac, tdc, electrodes0..18.

Components may be written ``position_x``, ``position.x``, ``position0``, ``positionx`` or ``position[0]`` (and so for
force), with a ROS prefix such as ``field.tactiles0.`` (these spellings are assumed: no such file was at hand)."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace

from ...sensors import ELECTRODES
from ..assemble import check_electrodes
from ..recording import Recording
from ..tables.table import Table
from . import of_table, share

CONTAINER = "csv"
NAME = "CSV with time, position (3), force (3), pac0, pac1, pdc, tac, tdc, electrodes0..18"
VECTORS = [f"{word}_{axis}" for word in ("position", "force") for axis in "xyz"]
ELECTRODE_NAMES = [f"electrodes{i}" for i in range(ELECTRODES)]
COLUMNS = ["time", *VECTORS, "pac0", "pac1", "pdc", "tac", "tdc", *ELECTRODE_NAMES]
VECTOR = re.compile(r"(?:^|.*[^a-z])(position|force)[^a-z0-9]*([xyz012])[^a-z0-9]*$")
OTHER = re.compile(r"(?:^|.*[^a-z])(electrodes|pac|pdc|tac|tdc|time)\W*(\d*)\W*$")


def canonical(names: Sequence[str]) -> list[str]:
    """Return the column names in this layout's spelling; unknown names stay as they are."""
    found = []
    for name in names:
        vector, other = VECTOR.match(name), OTHER.match(name)
        if vector:
            axis = vector[2] if vector[2] in "xyz" else "xyz"[int(vector[2])]
            found.append(f"{vector[1]}_{axis}")
        else:
            found.append(other[1] + other[2] if other else name)
    return found


def score(keys: Collection[str]) -> float:
    """Return the share of time and electrodes among keys, the columns' names, in any spelling."""
    return share(canonical(list(keys)), ["time", *ELECTRODE_NAMES])


def read(table: Table) -> Recording:
    """Return a table's recording. Raises TactileError for a missing column, and for what `assemble` refuses."""
    names = canonical(table.header)
    known, called = dict(zip(table.header, names, strict=False)), dict(zip(names, table.header, strict=False))
    table.taken.update(called.get(name, name) for name in COLUMNS)
    table = replace(
        table,
        header=tuple(names),
        problems=tuple(replace(p, field=known.get(p.field, p.field)) for p in table.problems),
    )
    held = sum(name.startswith("electrodes") for name in names)
    if held > ELECTRODES:
        check_electrodes(table.path, held, "line 1")
    table.columns([name for name in COLUMNS if name not in ELECTRODE_NAMES])  # names the first that is missing
    vectors = {"position": VECTORS[:3], "force": VECTORS[3:]}
    return of_table(table, NAME, "time", ELECTRODE_NAMES, pac=["pac0", "pac1"], **vectors)
