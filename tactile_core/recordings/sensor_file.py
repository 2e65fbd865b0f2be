"""A sensor's own gains and offsets: the TOML file of `tactile adapt`, and what it does to signals."""

from __future__ import annotations

import dataclasses
import json
import os
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from .. import atomic
from ..errors import TactileError
from ..small_text import read_toml_text
from .recording import ELECTRODES
from .signals import Signals

FORMAT = "tactile-sensor-1"
LEAST, MOST = 0.2, 5.0  # a gain beyond is a broken channel or a match gone wrong, not a unit (assumed)
LARGEST_OFFSET = 500.0  # counts; a raw reading's rest is never that near to a change (assumed)
ADVICE = "Make it again with `tactile adapt`"
Gains = Annotated[list[float], Meta(min_length=ELECTRODES, max_length=ELECTRODES)]


class Sensor(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A sensor against the simulated one: reading = gain * simulated change + offset, E1 .. E19.

    gain : counts a count; offset_counts : counts; note : how it was made
    """

    format: str
    note: str
    gain: Gains
    offset_counts: Gains


def apply(signals: Signals, sensor: Sensor) -> Signals:
    """Signals as the simulated sensor would give them: (change - offset) / gain; the report says so.

    A rectified change has lost its offset with its sign: it is only divided by the gain.
    """
    offset = np.zeros(ELECTRODES) if signals.kind == "rectified" else np.array(sensor.offset_counts)
    told = {"gain": list(sensor.gain), "offset_counts": offset.tolist(), "note": sensor.note}
    change = (signals.change - offset) / np.array(sensor.gain)
    return dataclasses.replace(signals, change=change, report={**signals.report, "sensor": told})


def read(path: str | os.PathLike) -> Sensor:
    """Read a sensor file; raises TactileError naming file and field for what is unreadable, unknown or out of range."""
    file = Path(path)
    try:
        sensor = msgspec.toml.decode(read_toml_text(file), type=Sensor)
    except OSError as error:
        raise TactileError(file, f"cannot be read ({error.strerror})", "a file of `tactile adapt`") from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "a file of `tactile adapt`", ADVICE) from error
    check(sensor, file)
    return sensor


def check(sensor: Sensor, where: str | os.PathLike) -> None:
    """Raises TactileError naming the field that is out of range."""
    if sensor.format != FORMAT:
        raise TactileError(f"{where}, format", repr(sensor.format), repr(FORMAT), ADVICE)
    limits = {"gain": (LEAST, MOST), "offset_counts": (-LARGEST_OFFSET, LARGEST_OFFSET)}
    for field, (least, most) in limits.items():
        for electrode, value in enumerate(getattr(sensor, field), start=1):
            if not least <= value <= most:  # false for nan
                place = f"{where}, {field}, E{electrode}"
                raise TactileError(place, f"{value:g}", f"{least:g} to {most:g}", ADVICE)


def write(path: str | os.PathLike, sensor: Sensor) -> None:
    """Write a sensor file, whole or not at all; equal sensors give equal bytes."""
    text = "\n".join([
        "# A BioTac against the simulated one: reading = gain * simulated change + offset, electrodes E1 to E19.",
        "# Used by: tactile convert RECORDING --sensor THIS_FILE",
        f"format = {_quoted(sensor.format)}",
        f"note = {_quoted(sensor.note)}",
        f"gain = {_numbers(sensor.gain)}  # counts a count",
        f"offset_counts = {_numbers(sensor.offset_counts)}",
        "",
    ])  # fmt: skip
    atomic.write_bytes(path, text.encode())


def _quoted(text: str) -> str:
    """A TOML basic string; JSON's escapes are among TOML's, and its ASCII keeps file names that are no UTF-8."""
    return json.dumps(text.encode(errors="replace").decode())


def _numbers(values: list[float]) -> str:
    return "[" + ", ".join(f"{value:.4f}" for value in values) + "]"
