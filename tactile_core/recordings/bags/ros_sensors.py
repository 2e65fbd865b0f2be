"""Find the BioTacs in ROS messages by the names of their fields, whatever the messages are called."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

from .ros_messages import ARRAY, NAME, NUMBERS, SEQUENCE, TIME, Definition

MOST = 100  # sensors, or lists of them, of one type of message (assumed enough: the drivers have one list)
MOST_PAC = 1000  # samples of PAC per message (assumed enough: the drivers have 2 and 22)
ELECTRODES = re.compile(r"electrodes?(_(data|values?|vals?|raw|counts))?$", re.IGNORECASE)
SLOW = {name: re.compile(rf"(^|.*_){name}(_(data|value|val|raw))?$", re.IGNORECASE) for name in ("pdc", "tac", "tdc")}
PAC = re.compile(r"(^|.*_)pac(\d*|_?(data|values?|vals?|raw))$", re.IGNORECASE)


@dataclass(frozen=True)
class SensorFields:
    """Names of the fields of a sensor, or of each in a list of sensors, in a message.
    path : names of the fields that lead to it; electrodes : name of the field that holds all electrodes
    slow : names of the fields of pdc, tac and tdc, "" for a missing one; pac : names of the fields with PAC's samples
    others : names of the fields that are not read"""

    path: tuple[str, ...]
    electrodes: str
    slow: tuple[str, str, str]
    pac: tuple[str, ...]
    others: tuple[str, ...]


def sensors_in(definition: Definition) -> list[SensorFields]:
    """Return the fields of each sensor, or list of sensors, in a message type; an empty list without electrodes."""
    return list(islice(_search(definition, definition.root, (), set()), MOST))


def _search(definition: Definition, name: str, path: tuple[str, ...], searched: set[str]) -> Iterator[SensorFields]:
    """Yield the fields of the sensors in the type `name`, which the fields of `path` lead to.
    searched : names of types without sensors, or whose search is not over"""
    fields = definition.fields(name)
    row = next((field for field, kind in fields if ELECTRODES.search(field) and _is_row(kind)), None)
    if row is not None:
        slow = [next((field for field, _ in fields if each.match(field)), "") for each in SLOW.values()]
        pac = tuple(field for field, _ in fields if PAC.match(field))
        others = tuple(field for field, kind in fields if field not in {row, *slow, *pac} and not _is_time(kind))
        yield SensorFields(path, row, (slow[0], slow[1], slow[2]), pac, others)
        return
    searched.add(name)
    barren = True
    for field, kind in fields:
        within = kind if int(kind[0]) == NAME else kind[1][0] if int(kind[0]) in (ARRAY, SEQUENCE) else None
        if within is not None and int(within[0]) == NAME and within[1] not in searched:
            for found in _search(definition, within[1], (*path, field), searched):
                yield found
                barren = False
    if not barren:
        searched.discard(name)


def _is_row(kind: Any) -> bool:
    """Return true for a list of numbers."""
    return int(kind[0]) in (ARRAY, SEQUENCE) and int(kind[1][0][0]) != NAME and kind[1][0][1][0] in NUMBERS


def _is_time(kind: Any) -> bool:
    return int(kind[0]) == NAME and kind[1] in (TIME, "std_msgs/msg/Header")


def in_message(message: dict[str, Any], fields: SensorFields) -> list[dict[str, Any]]:
    """Return the sensors that a decoded message holds at the path of ``fields``, each a dictionary field -> value."""
    found = [message]
    for name in fields.path:
        found = [each for one in found for each in (one[name] if isinstance(one[name], list) else [one[name]])]
    return found


def channels(sensor: dict[str, Any], fields: SensorFields) -> tuple[list[float], list[float]]:
    """Return two lists of counts: a sensor's pdc, tac, tdc (NaN if missing) and PAC's samples; and its electrodes.
    sensor : its part of a decoded message. Raises ValueError for more than `MOST_PAC` samples."""
    row = [float(sensor[name]) if name else float("nan") for name in fields.slow]
    for name in fields.pac:
        samples = sensor[name]
        row += [float(samples)] if samples.ndim == 0 else samples.tolist()
    if len(row) > 3 + MOST_PAC:
        raise ValueError(f"{len(row) - 3} samples of PAC")
    return row, sensor[fields.electrodes].tolist()


def stamp_of(message: dict[str, Any]) -> float:
    """Return the unix time, s, that a message's header, or the message itself, states; 0 if there is none."""
    held = message.get("header", message)
    stamp = held.get("stamp", held.get("time")) if isinstance(held, dict) else None
    return float(stamp["sec"] + 1e-9 * stamp["nanosec"]) if isinstance(stamp, dict) and "sec" in stamp else 0.0


def not_read(definition: Definition, fields: list[SensorFields]) -> list[str]:
    """Return the names of a message's fields that are not read: those beside its sensors, and the sensors' `others`."""
    used = {each.path[0] for each in fields if each.path}
    beside = [
        name for name, kind in definition.fields(definition.root) if used and name not in used and not _is_time(kind)
    ]
    return [*beside, *(name for each in fields for name in each.others)]
