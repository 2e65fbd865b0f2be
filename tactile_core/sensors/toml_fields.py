"""Fields of a sensor's files: units, ranges, and conversion from TOML to dataclasses; for Blender, with numpy alone.

A field's name ends in its unit; in Python it has the name without the unit, and its value is in SI units. Decimals are
shifted to SI units before they are rounded to floats, so that 20.06 mm is the number 20.06e-3 exactly.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
import typing
from collections.abc import Callable, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

from ..errors import TactileError
from ..files.outside import read_toml_text

_SHIFTS = {"mm": -3, "um": -6, "per_mm": 3, "mpa": 6}  # decimal places between a unit and SI
_AS_THEY_ARE = ("pa", "ohm", "hz", "px", "s_per_m", "pa_per_count", "counts", "deg")  # but that degrees become radians
_OTHERS = ("m", "cm", "in", "kpa", "gpa", "bar", "kohm", "khz", "s", "ms", "rad", "n", "v", "mv")  # units often written
LARGEST_MM, LEAST_MM = 200, 0.05  # of a fingertip: outside, another unit is meant (assumed)
MOST_NODES = 300  # along a line of a lattice: a compliance of 90,000 nodes fits no memory
LARGEST = 1e8  # of any number, as the radiance of a spot of 0.05 mm is; squares of much larger ones overflow
MAY_MISS = {"may_miss": True}  # metadata of a field that a file may leave out for its default
IN_PYTHON = {"in_file": False}  # metadata of a field that no file has
_T = TypeVar("_T")


def number(
    unit: str = "",
    *,
    above: float = -LARGEST,
    below: float = LARGEST,
    default: Any = dataclasses.MISSING,
    may_miss: bool = False,
    length: int | None = None,
) -> Any:
    """Declare a dataclass's field that is a number or a list of numbers.
    unit : in the file, the ending of the field's name there; "" for none
    above, below : ends of the open interval in that unit; default : in Python's SI units
    may_miss : true if a file may leave it out; length : of lists, if their type has none"""
    meta = {"unit": unit, "above": above, "below": below, "may_miss": may_miss, "length": length}
    return dataclasses.field(default=default, metadata=meta)


def file_beside(*, or_none: bool = False) -> Any:
    """Declare a field that names a file beside the one that is read.
    or_none : true if it may be left out, and then is empty"""
    meta = {"beside": True, "may_miss": or_none}
    return dataclasses.field(metadata=meta, default="" if or_none else dataclasses.MISSING)


def one_of(words: tuple[str, ...]) -> Any:
    """Declare a field whose text is one of these words."""
    return dataclasses.field(metadata={"words": words})


@dataclasses.dataclass(frozen=True)
class Material:
    """An isotropic elastic solid at small strain. youngs : Pa, Young's modulus; poisson : Poisson's ratio, below 0.5"""

    youngs: float = number("mpa", above=1e-4, below=100)  # gels and rubbers; outside, another unit is meant (assumed)
    poisson: float = number(above=0, below=0.5)


def read_toml(file: Path, made: Callable[[dict[str, Any]], _T], expected: str, advice: str = "") -> _T:
    """Return ``made(content)``, where content is a file's as a dict, decimals as written (``Decimal``).
    expected, advice : for errors: what the file should be, what to do. Raises TactileError naming file and field."""
    try:
        content = tomllib.loads(read_toml_text(file), parse_float=Decimal)
    except OSError as error:
        raise TactileError(file, f"cannot be read ({error.strerror})", expected) from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), expected, advice) from error
    try:
        return made(content)
    except TactileError as error:
        raise TactileError(f"{file}, {error.where}", error.found, error.expected, error.advice or advice) from error


def read_table(form: type[_T], content: Any, where: str = "", **others: Any) -> _T:
    """Convert ``content``, a table of a file, to the dataclass ``form`` in SI units.
    where : the table's name, for errors, "" for the whole file; others : values of fields that no file has
    Raises TactileError for a field that is unknown, missing or out of range."""
    if not isinstance(content, dict):
        raise TactileError(where, repr(content), "a table")
    types = typing.get_type_hints(form)
    fields = {
        key: each for each in dataclasses.fields(form)  # type: ignore[arg-type]
        if each.metadata.get("in_file", True)
        and ((key := _key(each)) in content or not each.metadata.get("may_miss"))
    }  # fmt: skip
    check_names(where or "top level", content, tuple(fields))
    values = {
        each.name: read_value(types[each.name], content[key], f"{where}, {key}".removeprefix(", "), each.metadata)
        for key, each in fields.items()
    }
    return form(**values, **others)


def _key(each: dataclasses.Field) -> str:
    """Return a field's name in the file, which ends in its unit."""
    unit = each.metadata.get("unit")
    return f"{each.name}_{unit}" if unit else each.name


def check_names(where: str, content: dict[str, Any], names: tuple[str, ...]) -> None:
    """Raise TactileError unless the fields of ``content``, a table of a file, are exactly ``names``: for one that is
    missing, unknown or in another unit. where : the table's name, for the message"""
    fields = f"the fields {', '.join(names)}"
    for name in sorted(set(content) - set(names)):
        for right in names:
            if right not in content and _without_unit(right) == _without_unit(name):
                raise TactileError(where, name, right, "Give the number in the unit that the field's name ends in")
        raise TactileError(where, f"unknown {name}", fields)
    missing = [name for name in names if name not in content]
    if missing:
        raise TactileError(where, f"{', '.join(missing)} missing", fields)


def _without_unit(name: str) -> str:
    for unit in sorted((*_SHIFTS, *_AS_THEY_ARE, *_OTHERS), key=len, reverse=True):
        if name.endswith(f"_{unit}"):
            return name.removesuffix(f"_{unit}")
    return name


def read_value(kind: Any, value: Any, where: str, meta: Mapping[str, Any]) -> Any:
    """Convert ``value``, from a file, to a field's type ``kind``, in SI units. where : the field's name, for errors
    meta : metadata of the field's declaration. Raises TactileError for a value of another type or out of range."""
    kind = next((each for each in typing.get_args(kind) if dataclasses.is_dataclass(each)), kind)  # of Dome | None
    if dataclasses.is_dataclass(kind):
        return read_table(typing.cast(type, kind), value, where, **meta.get("given", {}))
    if typing.get_origin(kind) is tuple:
        items = typing.get_args(kind)
        length = meta.get("length") if items[-1] is Ellipsis else len(items)
        if not isinstance(value, list) or length not in (None, len(value)):
            raise TactileError(where, f"{value!r:.80}", "a list" if length is None else f"a list of {length}")
        return tuple(read_value(items[0], item, where, meta) for item in value)
    if typing.get_origin(kind) is Mapping:
        if not isinstance(value, dict):
            raise TactileError(where, repr(value), "a table of numbers")
        return {name: _number(float, item, f"{where}, {name}", meta) for name, item in value.items()}
    if kind is str:
        words = meta.get("words")
        if not isinstance(value, str) or (words and value not in words):
            raise TactileError(where, repr(value), " or ".join(words) if words else "text")
        if meta.get("beside") and Path(value).name != value:
            raise TactileError(where, repr(value), "the name of a file beside this one")
        return value
    return _number(kind, value, where, meta)


def _number(kind: type[float] | type[int], value: Any, where: str, meta: Mapping[str, Any]) -> float | int:
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole and (kind is int or not isinstance(value, Decimal)):
        raise TactileError(where, f"{value!r:.80}", "a whole number" if kind is int else "a number")
    above, below, unit = meta["above"], meta["below"], meta["unit"]
    if not above < float(Decimal(value)) < below:  # also refuses nan
        limits = [f"above {above:g}"] * (above > -LARGEST) + [f"below {below:g}"] * (below < LARGEST)
        finite = [] if Decimal(value).is_finite() else ["a finite number"]
        words = [*finite, " and ".join(limits)] if limits or finite else ["a number of", f"{LARGEST:g} at most"]
        raise TactileError(where, f"{value!s:.80}", " ".join(words).strip())
    if kind is int:
        return int(value)
    return math.radians(value) if unit == "deg" else float(Decimal(value).scaleb(_SHIFTS.get(unit, 0)))
