"""Decode ROS messages by their definitions, which are parsed and never compiled (the decoding library generates code
from definitions, and those of a bag come from strangers); and find the BioTacs in them by the names of their fields."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

NUMBERS = {
    "bool": "?", "byte": "u1", "octet": "u1", "char": "u1", "float32": "f4", "float64": "f8",
    **{f"{sign}int{bits}": f"{code}{bits // 8}" for sign, code in (("", "i"), ("u", "u")) for bits in (8, 16, 32, 64)},
}  # fmt: skip
NAME, ARRAY, SEQUENCE = 2, 3, 4  # rosbags' numbers of a field's kind; 1 is a number or a text
TIME = "builtin_interfaces/msg/Time"  # ROS 1 has it built in
MOST_TEXT = 2**16  # characters of a definition (assumed enough: sensor_msgs/PointCloud2 has 3,000)
PADDING = 3  # bytes that may follow a ROS 2 message
MOST_SENSORS = 100  # sensors, or lists of them, of one type of message (assumed enough: the drivers have one list)
MOST_PAC = 1000  # samples of PAC per message (assumed enough: the drivers have 2 and 22)
ELECTRODES = re.compile(r"electrodes?(_(data|values?|vals?|raw|counts))?$", re.IGNORECASE)
SLOW = {name: re.compile(rf"(^|.*_){name}(_(data|value|val|raw))?$", re.IGNORECASE) for name in ("pdc", "tac", "tdc")}
PAC = re.compile(r"(^|.*_)pac(\d*|_?(data|values?|vals?|raw))$", re.IGNORECASE)
# Types that definitions may leave out: those of time are built into ROS 1.
_TIME = "int32 sec\nuint32 nanosec\n"
PLAIN = {
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id\n", TIME: _TIME,
    "builtin_interfaces/msg/Duration": _TIME,
}  # fmt: skip
_SENSOR = "int16 pac0\nint16 pac1\nint16 pdc\nint16 tac\nint16 tdc\nint16[{}] electrodes\n"
_HAND = """\
std_msgs/Header header
string hand_id
biotac_sensors/BioTacData[] bt_data
biotac_sensors/BioTacTime bt_time
"""
_DATA = """\
string bt_serial
uint16 bt_position
uint16 tdc_data
uint16 tac_data
uint16 pdc_data
uint16[22] pac_data
uint16[19] electrode_data
"""
_OFFSETS = """\
builtin_interfaces/Time frame_start_time
builtin_interfaces/Time frame_end_time
uint32 tdc_ns_offset
uint32 tac_ns_offset
uint32 pdc_ns_offset
uint32[22] pac_ns_offset
uint32[19] electrode_ns_offset
"""
# Messages of the drivers of SynTouch and Shadow Robot, for bags that carry no definitions, as ROS 2 wrote before 2023.
# Those of Shadow's have an open list of electrodes, in older versions one of 19.
KNOWN: dict[str, list[dict[str, str]]] = {
    "biotac_sensors/msg/BioTacHand": [{
        "biotac_sensors/msg/BioTacHand": _HAND, "biotac_sensors/msg/BioTacData": _DATA,
        "biotac_sensors/msg/BioTacTime": _OFFSETS,
    }],
    "sr_robot_msgs/msg/BiotacAll": [
        {"sr_robot_msgs/msg/BiotacAll": "std_msgs/Header header\nsr_robot_msgs/Biotac[5] tactiles\n",
         "sr_robot_msgs/msg/Biotac": _SENSOR.format(count)} for count in ("", "19")
    ],
    "sr_robot_msgs/msg/Biotac": [{"sr_robot_msgs/msg/Biotac": _SENSOR.format(count)} for count in ("", "19")],
}  # fmt: skip


@dataclass(frozen=True)
class Definition:
    """Definition of a message type, and of the types inside it.
    root : name of the message's type; types : type's name -> names and kinds of its fields, as rosbags parses them"""

    root: str
    types: dict[str, list[tuple[str, Any]]]

    def fields(self, name: str) -> list[tuple[str, Any]]:
        """Return names and kinds of the fields of the type of that name; an empty list if it is unknown."""
        return self.types.get(name, [])


def definitions(kind: str, text: str, idl: bool) -> list[Definition]:
    """Return the possible definitions of the message type `kind`, an empty list if they cannot be read.
    text : the definition in the bag, in IDL if `idl` is true; if it is empty, the drivers' own (`KNOWN`) are taken"""
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if len(text) > MOST_TEXT or (text and "electrode" not in text.lower()):
        return []
    try:
        if text:
            parsed = [get_types_from_idl(text) if idl else get_types_from_msg(text, kind)]
        else:
            parsed = [_parsed(version) for version in KNOWN.get(kind, [])]
    except Exception:  # the library raises a dozen types on odd text
        return []
    plain = _parsed(PLAIN)
    return [Definition(kind, {name: fields for name, (_, fields) in (plain | each).items()}) for each in parsed]


def _parsed(texts: dict[str, str]) -> dict[str, Any]:
    from rosbags.typesys import get_types_from_msg

    return {name: get_types_from_msg(text, name)[name] for name, text in texts.items()}


def decoded(definition: Definition, ros1: bool, data: bytes) -> dict[str, Any]:
    """Decode a message to a dictionary: field -> number, array, text, dictionary or list of these. Raises ValueError,
    KeyError or RecursionError if it does not fit the definition."""
    cursor = _Cursor(definition, ros1, data)
    message = cursor.message(definition.root)
    if not 0 <= len(data) - cursor.place <= PADDING * (not ros1):
        raise ValueError(f"{len(data) - cursor.place} bytes are left")
    return message


class _Cursor:
    """Reader of a message's bytes in order: ROS 1 packs them, ROS 2 (CDR) aligns each number to its own size."""

    def __init__(self, definition: Definition, ros1: bool, data: bytes) -> None:
        self._types, self._data, self.place, self._aligned, self._order = definition.types, data, 0, not ros1, "<"
        self._messages = 0
        if not ros1:
            self._order = {b"\0\0": ">", b"\0\1": "<"}[bytes(data[:2])]
            self.place = 4

    def message(self, name: str) -> dict[str, Any]:
        """Read the next message, of the type `name`. Raises ValueError once there are more nested messages than bytes,
        as empty ones in nested lists would make."""
        self._messages += 1
        if self._messages > len(self._data) + 64:
            raise ValueError("more entries than bytes")
        return {field: self._value(kind) for field, kind in self._types[name]}

    def _value(self, kind: Any) -> Any:
        node, what = int(kind[0]), kind[1]
        if node == NAME:
            return self.message(what)
        if node not in (ARRAY, SEQUENCE):
            return self._text(what[0]) if "string" in what[0] else self._numbers(NUMBERS[what[0]], 1)[0]
        of, count = what
        if node == SEQUENCE:
            count = int(self._numbers("u4", 1)[0])
        numbers = None if int(of[0]) == NAME else NUMBERS.get(of[1][0])
        if numbers is not None:
            return self._numbers(numbers, count)
        if count > len(self._data):  # each takes a byte or more
            raise ValueError(f"{count} entries in {len(self._data)} bytes")
        return [self._value(of) for _ in range(count)]

    def _numbers(self, kind: str, count: int) -> np.ndarray:
        """Return the next numbers (count,); kind : their type as numpy writes it, without byte order, as "u4" """
        dtype = np.dtype(self._order + kind)
        if count == 0:
            return np.empty(0, dtype)
        if self._aligned:
            self.place += -(self.place - 4) % dtype.itemsize
        found = np.frombuffer(self._data, dtype, count, self.place)
        self.place += found.nbytes
        return found

    def _text(self, kind: str) -> str:
        """Read the next text, of kind "string" or "wstring"."""
        length = int(self._numbers("u4", 1)[0]) * (2 if kind == "wstring" else 1)
        self.place += length
        if self.place > len(self._data):
            raise ValueError(f"a text of {length} bytes")
        return bytes(self._data[self.place - length : self.place]).rstrip(b"\0").decode("utf-8", "replace")


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
    return list(islice(_search(definition, definition.root, (), set()), MOST_SENSORS))


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
