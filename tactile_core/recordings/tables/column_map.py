"""Map of a recording's columns, for files of no known layout: a TOML file that says which column is what. A column is
that of a text table, a field of JSON records, or a column of an array. ``map_guess`` proposes a map, ``mapped`` reads a
recording by it; ``write`` and ``read`` are for the map's file."""

from __future__ import annotations

import json
import os
import re
import tomllib
from dataclasses import dataclass, fields
from pathlib import Path

from ...errors import TactileError
from ...files import atomic
from ...files.outside import read_toml_text
from ...files.short_text import listed
from ...sensors import ELECTRODES, SAMPLE_RATE
from ..time_stamps import Unit

FORMAT = "tactile-columns-1"
CHANNELS = "pdc", "tac", "tdc"
ADVICE = "Write it again: tactile info RECORDING --columns NEW.toml"
RATES = 1.0, 1e4  # Hz
MOST_NAMED = 40  # of the file's columns, in the comment of a new map


@dataclass(frozen=True)
class ColumnMap:
    """Names of a file's columns, in any case; "" stands for a column that the file lacks.

    electrodes : names of the columns of E1 to E19, or the name of an array of 19 columns
    time : name of the column of time; time_unit : its unit, "s", "ms", "us" or "ns"; rate : Hz, used without such a
    column
    pdc, tac, tdc : names of these columns
    channel, value : names of two columns of a long table, which has a row for each value of each channel: that of the
        channel's name, and that of the value. Then electrodes, pdc, tac and tdc are names of channels"""

    electrodes: tuple[str, ...] = ()
    time: str = ""
    time_unit: Unit = "s"
    rate: float = SAMPLE_RATE
    pdc: str = ""
    tac: str = ""
    tdc: str = ""
    channel: str = ""
    value: str = ""

    def channels(self) -> set[str]:
        """Return the names, in lower case, of the electrodes, pdc, tac and tdc that the file has."""
        return {name.lower() for name in (*self.electrodes, self.pdc, self.tac, self.tdc) if name}

    def names(self) -> list[str]:
        """Return the names, in lower case, of all columns that the map uses."""
        values = (self.channel, self.value) if self.channel else (*self.electrodes, self.pdc, self.tac, self.tdc)
        return [name.lower() for name in (*values, self.time) if name]

    def is_nanoseconds(self, name: str) -> bool:
        """Return true for the column of nanoseconds beside that of s, as ``stamp.nanosec`` in ROS."""
        stem = re.sub(r"secs?$", "", self.time.lower())
        return stem != self.time.lower() and re.fullmatch(re.escape(stem) + r"n(ano)?secs?", name) is not None


def read(path: str | os.PathLike) -> ColumnMap:
    """Return a file's map. Raises TactileError, with file and field, for what is unreadable, unknown or missing."""
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
    named = [name.lower() for name in columns.electrodes if name]
    one = len(columns.electrodes) == 1 == len(named) and not columns.channel
    if not one and (len(columns.electrodes) != ELECTRODES or len(set(named)) < len(named) or not named):
        held = f"{len(columns.electrodes)} names, {len(set(named))} different ones"
        expected = f"{ELECTRODES}, of E1 to E{ELECTRODES}, or that of one array"
        advice = 'Write each column\'s name there once, and "" for an electrode that there is not'
        raise TactileError(f"{file}, electrodes", held, expected, advice)
    used = columns.names()
    for name in used:
        if used.count(name) > 1:
            raise TactileError(
                f"{file}, {name:.80}", "a column that is named twice", "once", 'Write "" for one there is not'
            )
    if bool(columns.channel) != bool(columns.value):
        expected = "both of a long table, or none"
        raise TactileError(f"{file}, channel", "channel and value: one is named", expected, "Name the other, too")
    if not RATES[0] <= columns.rate <= RATES[1]:
        raise TactileError(f"{file}, rate", f"{columns.rate:g}", f"{RATES[0]:g} to {RATES[1]:g} Hz")
    return columns


def write(path: str | os.PathLike, guessed: list[ColumnMap], held: tuple[str, ...]) -> None:
    """Write the first of the guessed maps to a file, those of further fingers as comments.
    held : names of all columns of the recording, for a comment"""
    quoted = json.dumps(listed(held, MOST_NAMED))[1:-1]  # escaped, so that no name ends the comment
    columns, *others = guessed
    lines = [
        "# Which column of a recording is what; guessed: check it. Leave empty what is not there.",
        "# Used by: tactile convert RECORDING --columns THIS_FILE",
        f"# Columns of the recording: {quoted}",
        f'format = "{FORMAT}"',
        f"time = {json.dumps(columns.time)}",
        f'time_unit = "{columns.time_unit}"  # s, ms, us or ns; times such as 2012-11-08 17:12:03.45 are read, too',
        f"rate = {columns.rate:g}  # Hz, where time is empty",
        *_channel_lines(columns),
        "# Of a long table, a row for each value of a channel; the names above are then those of channels:",
        f"channel = {json.dumps(columns.channel)}",
        f"value = {json.dumps(columns.value)}",
    ]
    for other in others:
        lines += ["# Another finger:", *(f"# {line}" for line in _channel_lines(other))]
        lines += [f"# value = {json.dumps(other.value)}"] * bool(other.value)
    atomic.write_bytes(path, "\n".join([*lines, ""]).encode())


def _channel_lines(columns: ColumnMap) -> list[str]:
    return [
        f"electrodes = [{', '.join(map(json.dumps, columns.electrodes))}]  # E1 to E{ELECTRODES}",
        *(f"{name} = {json.dumps(getattr(columns, name))}" for name in CHANNELS),
    ]


def refuse_bag(path: str, container: str) -> None:
    """Raise TactileError if the container is "bag": a bag's messages name their fields, so it needs no map."""
    if container == "bag":
        raise TactileError("--columns", f"given for {path} (bag)", "a file of columns or arrays", "Leave it out")
