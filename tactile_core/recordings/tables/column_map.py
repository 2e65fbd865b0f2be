"""Columns of a CSV file whose names no layout knows: a TOML file that says which column is what.

``guess(names)`` proposes a map from the names in the header; ``write`` and ``read`` keep it in a file; `read_mapped`
makes the recording.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from ...errors import TactileError
from ...files import atomic
from ...files.outside import read_toml_text
from ...sensors import ELECTRODES
from ...sensors.biotac_sp import ELECTRODES as SP_ELECTRODES
from ..assemble import assemble, check_electrodes
from ..recording import Recording
from .table import Table

FORMAT = "tactile-columns-1"
LAYOUT = "CSV with columns mapped by --columns"
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
CHANNELS = "pdc", "tac", "tdc"
ADVICE = "Write it again: tactile info RECORDING --columns NEW.toml"
NUMBERED = re.compile(r"(.*?)(\d+)(\D*)$", re.DOTALL)
TIME = re.compile(r"time|stamp|^t$|^t\W|sec")
UNIT = re.compile(r"(?:^|[^a-z])(ns|us|ms|s)(?:[^a-z]|$)")
MOST_NAMED = 40  # of the file's columns, in the comment of a new map


@dataclass(frozen=True)
class ColumnMap:
    """Names of a file's columns, in any case.

    electrodes : of E1 to E19; time : empty where there is none, 100 Hz is assumed then; time_unit : of that column
    pdc, tac, tdc : empty where there are none
    """

    electrodes: tuple[str, ...] = ()
    time: str = ""
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    pdc: str = ""
    tac: str = ""
    tdc: str = ""

    def names(self) -> set[str]:
        """Return the names of all mapped columns, in lower case."""
        return {name.lower() for name in (*self.electrodes, self.time, self.pdc, self.tac, self.tdc) if name}


def read(path: str | os.PathLike) -> ColumnMap:
    """Read a map; raises TactileError naming file and field for what is unreadable, unknown or missing."""
    import msgspec  # not by every reader: Blender without wheels has none

    file = Path(path)
    try:
        found = tomllib.loads(read_toml_text(file))
        stated = found.pop("format", None)
        if stated != FORMAT:
            raise TactileError(f"{file}, format", f"{stated!r:.80}", repr(FORMAT), ADVICE)
        known = [field.name for field in fields(ColumnMap)]
        for name in found:
            if name not in known:
                raise TactileError(f"{file}, {name:.80}", "an unknown field", ", ".join(known), "Leave it out")
        columns = msgspec.convert(found, ColumnMap)
    except OSError as error:
        advice = "Write one: tactile info RECORDING --columns NEW.toml"
        raise TactileError(file, f"cannot be read ({error.strerror})", "a map of columns", advice) from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "a map of columns", ADVICE) from error
    different = len({name.lower() for name in columns.electrodes})
    if not different == len(columns.electrodes) == ELECTRODES:
        held = f"{len(columns.electrodes)} names, {different} different ones"
        raise TactileError(
            f"{file}, electrodes", held, f"{ELECTRODES}, of E1 to E{ELECTRODES}", "Write each column's name there once"
        )
    return columns


def write(path: str | os.PathLike, columns: ColumnMap, held: tuple[str, ...]) -> None:
    """Write a map to a new file, whole or not at all; held : the recording's columns, named in a comment."""
    named = ", ".join(held[:MOST_NAMED]) + (f" and {len(held) - MOST_NAMED} more" if len(held) > MOST_NAMED else "")
    quoted = json.dumps(named)[1:-1]  # escaped, so that no name ends the comment
    lines = [
        "# Which column of a recording is what; guessed from their names: check it. Leave empty what is not there.",
        "# Used by: tactile convert RECORDING --columns THIS_FILE",
        f"# Columns of the recording: {quoted}",
        f'format = "{FORMAT}"',
        f"time = {json.dumps(columns.time)}",
        f'time_unit = "{columns.time_unit}"  # s, ms, us or ns',
        f"electrodes = [{', '.join(map(json.dumps, columns.electrodes))}]  # E1 to E{ELECTRODES}",
        *(f"{name} = {json.dumps(getattr(columns, name))}" for name in CHANNELS),
    ]
    atomic.write_bytes(path, "\n".join([*lines, ""]).encode())


def guess(names: tuple[str, ...]) -> ColumnMap:
    """Guess the map of a CSV file from the names in its header, in lower case.

    Electrodes are left out where not 19 columns carry consecutive numbers.
    """
    time = next((name for name in names if TIME.search(name)), "")
    unit = UNIT.search(time.replace("_", " "))
    channels = {word: next((name for name in names if word in name), "") for word in CHANNELS}
    return ColumnMap(_numbered(names), time, unit[1] if unit else "s", **channels)  # type: ignore[arg-type]


def _numbered(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names that differ in a number alone, which runs through 19 values, in its order; none where there are no such."""
    series: dict[tuple[str, str], dict[int, str]] = {}
    for name in names:
        found = NUMBERED.match(name)
        if found and len(found[2]) < 4:
            series.setdefault((found[1], found[3]), {})[int(found[2])] = name
    whole = [
        tuple(each[number] for number in sorted(each))
        for each in series.values()
        if len(each) == ELECTRODES and max(each) - min(each) == ELECTRODES - 1
    ]
    return whole[0] if len(whole) == 1 else ()


def read_mapped(table: Table, columns: ColumnMap) -> Recording:
    """Make the recording of a table by a map.

    Raises TactileError for a column that is missing, and the errors of ``assemble``.
    """
    electrodes = [name.lower() for name in columns.electrodes]
    _check_series(table, electrodes)
    time = columns.time.lower()
    channels: dict[str, Any] = {
        name: table.column(column) for name in CHANNELS if (column := getattr(columns, name).lower())
    }
    return assemble(
        table.path,
        LAYOUT,
        electrodes=table.counts(electrodes),
        stamps=SECONDS[columns.time_unit] * table.column(time) if time else None,
        rows=table.lines,
        problems=table.essential([*([time] if time else []), *electrodes]),
        row_word="line",
        warnings=table.warnings,
        names=electrodes,
        **channels,
    )


def _check_series(table: Table, electrodes: list[str]) -> None:
    """Raise TactileError where the electrodes are 19 of the 24 columns of a BioTac SP."""
    parts = [NUMBERED.match(name) for name in (*table.header, *table.left_out)]
    stems = [(found[1], found[3]) for found in parts if found]
    for name in electrodes:
        found = NUMBERED.match(name)
        if found and stems.count((found[1], found[3])) == SP_ELECTRODES:
            check_electrodes(table.path, SP_ELECTRODES, f"line 1, columns {found[1]}..{found[3]}")


def refuse_other(path: str, container: str, columns: ColumnMap | None) -> None:
    """Raise TactileError where a map is given for a file that is no CSV."""
    if columns is not None and container != "csv":
        raise TactileError("--columns", f"given for {path} ({container})", "a CSV recording", "Leave it out")
