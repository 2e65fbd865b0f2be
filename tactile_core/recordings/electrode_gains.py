"""Rest, film, gains and offsets of a unit: the TOML file of `tactile adapt`, and its application to signals."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from ..errors import TactileError
from ..files import atomic
from ..files.outside import read_toml_text, toml_quoted, toml_value
from ..sensors import COUNT_MAX, SOURCE, divider, electrode_count, title, typical_rest
from ..sensors.descriptor import of_kind
from ..sensors.fluid_sensor import MOST_ELECTRODES, Fluid
from .preparation import doubt_law
from .recording import FINGERS, short_of
from .signals import Rest, Signals
from .unit import film

FORMAT = "tactile-sensor-2"
OLD_FORMAT = "tactile-sensor-1"  # its offsets were of counts that rise where a film thins
LEAST, MOST = 0.2, 5.0  # a gain beyond is a broken channel or a match gone wrong, not a unit (assumed)
LARGEST_OFFSET = 500.0  # counts; a raw reading's rest is never that near to a change (assumed)
ADVICE = "Make it again with `tactile adapt`"
Row = Annotated[list[float], Meta(min_length=1, max_length=MOST_ELECTRODES)]


class ElectrodeGains(msgspec.Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """Gains of a unit relative to the simulated one: reading - rest = gain * simulated change + offset. Lists hold a
    number for each electrode, E1 to E19; None stands for what is not known.

    gain : counts per count; offset_counts : counts; note : how the gains were found, in words
    rest_counts : readings without contact, counts; rest_spread_counts : half the range of the rests found in single
        recordings, counts; rest_pdc : PDC without contact, counts
    film : thickness of the unit's fluid film, divided by a typical unit's
    stiffness : stiffness of its skin, divided by a typical unit's, by which force and pressure are multiplied; known if
        a force was measured; stiffness_error : its relative error"""

    note: str
    gain: Row
    offset_counts: Row
    rest_counts: Row | None = None
    rest_spread_counts: Row | None = None
    rest_pdc: float | None = None
    film: float | None = None
    stiffness: float | None = None
    stiffness_error: float | None = None

    def rest(self) -> Rest | None:
        """Return the unit's rest, for ``PrepareOptions.rest``; None if it is unknown."""
        if self.rest_counts is None:
            return None
        return Rest(tuple(self.rest_counts), tuple(self.rest_spread_counts or [0.0] * len(self.gain)), self.rest_pdc)


class SensorFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """File of `tactile adapt`: one unit, or the units on a hand's fingers 0 to 4, each in its own section.
    format : `FORMAT`; topics : units of bags with several topics, by topic and finger, as ``left/biotac/finger2``
    sensor : name of the units' sensor: "biotac", or another, whose units have a rest and no gains"""

    format: str
    unit: ElectrodeGains | None = None
    finger0: ElectrodeGains | None = None
    finger1: ElectrodeGains | None = None
    finger2: ElectrodeGains | None = None
    finger3: ElectrodeGains | None = None
    finger4: ElectrodeGains | None = None
    sensor: str = SOURCE
    topics: dict[str, ElectrodeGains] | None = None

    def sections(self) -> dict[str, ElectrodeGains]:
        """Return the file's sections, by names such as ``unit``, ``finger2`` or ``left/biotac/finger2``."""
        names = ("unit", *(f"finger{number}" for number in range(FINGERS)))
        return {name: found for name in names if (found := getattr(self, name)) is not None} | (self.topics or {})

    def gains_for(
        self, recording: str | os.PathLike, section: str, where: str | os.PathLike, sensor: str = SOURCE
    ) -> ElectrodeGains:
        """Return the gains in a section. Raises TactileError if there is no such section, or for another sensor.
        recording, where : paths of the unit's recording and of this file, which the error names"""
        if self.sensor != sensor:
            found = f"a unit of {electrode_count(self.sensor)} electrodes, {self.sensor!r}"
            expected = f"one of {electrode_count(sensor)} electrodes, {sensor!r}, as {recording} is of"
            raise TactileError(where, found, expected)
        sections = self.sections()
        if section in sections:
            return sections[section]
        found = f"[{'], ['.join(sections)}], and {short_of(recording)} is of another unit"
        raise TactileError(where, found, f"a section [{section}]", "Adapt to recordings of that unit")


def units_file(units: dict[str, ElectrodeGains], sensor: str = SOURCE) -> SensorFile:
    """Return the content of a sensor file; units : section's name -> gains; sensor : name of the units' sensor"""
    topics = {name: unit for name, unit in units.items() if "/" in name}
    plain: dict[str, Any] = {name: unit for name, unit in units.items() if name not in topics}
    return SensorFile(FORMAT, **plain, sensor=sensor, topics=topics or None)


def apply(signals: Signals, sensor: ElectrodeGains) -> Signals:
    """Return signals with the changes that a unit with the simulated one's gains would have shown: (change - offset) /
    gain; of rectified signals change / gain. sensor : gains of the unit that was recorded
    Raw changes are converted to a typical unit's rest before, and back to this unit's rest after. The unit's stiffness
    is added, and it is checked again whether the contacts resemble simulated ones (`doubt_law`)."""
    offset = np.zeros(len(sensor.gain)) if signals.kind == "rectified" else np.array(sensor.offset_counts)
    applied = {"gain": list(sensor.gain), "offset_counts": offset.tolist(), "note": sensor.note}
    stiffness = 1.0 if sensor.stiffness is None else sensor.stiffness
    if sensor.stiffness is not None:
        applied |= {"stiffness": stiffness, "stiffness_error": sensor.stiffness_error}
    change = (signals.typical - offset) / np.array(sensor.gain)
    rest = typical_rest(signals.sensor)
    if signals.kind == "raw" and rest is not None:
        change = divider.of_unit(change, signals.rest, rest)
    change[~signals.change.any(axis=1)] = 0.0  # no contact
    report = {**signals.report, "sensor": applied}
    return doubt_law(dataclasses.replace(signals, change=change, report=report, stiffness=stiffness))


def read(path: str | os.PathLike) -> SensorFile:
    """Return a sensor file's content. Raises TactileError, with file and field, for what is unreadable or unfit."""
    file = Path(path)
    try:
        text = read_toml_text(file)
        if f'"{OLD_FORMAT}"' in text:
            found = "offsets of counts that rise where a film thins"
            raise TactileError(f"{file}, format", f"{OLD_FORMAT!r}: {found}", repr(FORMAT), ADVICE)
        sensor = msgspec.toml.decode(text, type=SensorFile)
    except OSError as error:
        raise TactileError(file, f"cannot be read ({error.strerror})", "a file of `tactile adapt`") from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "a file of `tactile adapt`", ADVICE) from error
    check(sensor, file)
    return sensor


def check(sensor: SensorFile, where: str | os.PathLike) -> None:
    """Raise TactileError, which names the field, for a value out of range. where : the file's path, for the message"""
    if sensor.format != FORMAT:
        raise TactileError(f"{where}, format", repr(sensor.format), repr(FORMAT), ADVICE)
    try:
        electrodes = of_kind(sensor.sensor, Fluid).electrodes.count
    except TactileError as error:
        raise TactileError(f"{where}, sensor", f"{sensor.sensor!r}, {error.found}", error.expected, ADVICE) from error
    if not sensor.sections():
        raise TactileError(where, "no section", "[unit], or [finger0], [finger1], ...", ADVICE)
    limits = {
        "gain": (LEAST, MOST), "offset_counts": (-LARGEST_OFFSET, LARGEST_OFFSET), "rest_counts": (0.0, COUNT_MAX),
        "rest_spread_counts": (0.0, COUNT_MAX),
    }  # fmt: skip
    for name, section in sensor.sections().items():
        for field, (least, most) in limits.items():
            held = getattr(section, field)
            if held is not None and len(held) != electrodes:
                expected = f"{electrodes}, the electrodes of {sensor.sensor!r}"
                raise TactileError(f"{where}, {name}.{field}", f"{len(held)} numbers", expected, ADVICE)
            for electrode, value in enumerate(held or (), start=1):
                if not least <= value <= most:  # false for nan
                    place = f"{where}, {name}.{field}, E{electrode}"
                    raise TactileError(place, f"{value:g}", f"{least:g} to {most:g}", ADVICE)
        for field, (least, most, unit) in {
            "film": (film.LEAST, film.MOST, " of a typical unit's"), "rest_pdc": (0.0, COUNT_MAX, ""),
            "stiffness": (LEAST, MOST, " of a typical unit's"), "stiffness_error": (0.0, MOST, ""),
        }.items():  # fmt: skip
            value = getattr(section, field)
            if value is not None and not least <= value <= most:
                expected = f"{least:g} to {most:g}{unit}"
                raise TactileError(f"{where}, {name}.{field}", f"{value:g}", expected, ADVICE)


def write(path: str | os.PathLike, sensor: SensorFile) -> None:
    """Write a sensor file, whole or not at all. Equal content gives equal bytes."""
    name, last = title(sensor.sensor), f"E{electrode_count(sensor.sensor)}"
    head: tuple[str, ...] = (
        f"A {name} against the simulated one: reading - rest = gain * simulated change + offset, E1 to {last}.",
        "gain in counts a count, film and stiffness over a typical unit's, all else in counts. Used by:",
        "tactile convert RECORDING --sensor THIS_FILE",
    )
    if typical_rest(sensor.sensor) is None:
        words = f"Rest of a {name}, E1 to {last}, in counts; film over a typical unit's."
        head = (words, "Used by: tactile convert RECORDING --sensor THIS_FILE")
    lines = [*(f"# {line}" for line in head), *_lines({"format": sensor.format, "sensor": sensor.sensor})]
    for section, unit in sensor.sections().items():
        table = f"topics.{toml_quoted(section)}" if "/" in section else section
        lines += ["", f"[{table}]", *_lines(msgspec.structs.asdict(unit))]
    atomic.write_bytes(path, ("\n".join(lines) + "\n").encode())


def _lines(fields: dict[str, Any]) -> list[str]:
    return [f"{name} = {toml_value(value)}" for name, value in fields.items() if value is not None]
