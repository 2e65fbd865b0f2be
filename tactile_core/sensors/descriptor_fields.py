"""Fields of a sensor's descriptor: their units and ranges, and how tables of the file become dataclasses.

A field's name ends in its unit; in Python it has the name without it, in SI units. Decimals are shifted to SI units
before they are rounded to floats, so that 20.06 mm is the number 20.06e-3 exactly.
"""

from __future__ import annotations

import dataclasses
import math
import typing
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

from ..errors import TactileError

# Decimal places between a unit and SI; degrees become radians.
_UNITS = {
    "mm": -3,
    "um": -6,
    "mpa": 6,
    "pa": 0,
    "ohm": 0,
    "hz": 0,
    "s_per_m": 0,
    "pa_per_count": 0,
    "counts": 0,
    "deg": 0,
}
_OTHERS = ("m", "cm", "in", "kpa", "gpa", "bar", "kohm", "khz", "s", "ms", "rad", "n", "v", "mv")  # units often written
LARGEST_MM, LEAST_MM = 200, 0.05  # of a fingertip: outside, another unit is meant (assumed)
MOST_NODES = 300  # along a line of a lattice: a compliance of 90,000 nodes fits no memory
_T = TypeVar("_T")


def number(unit: str = "", *, above: float = -math.inf, below: float = math.inf) -> Any:
    """Declare a number, or a list of them: its unit in the file, and the open interval in which it lies there."""
    return dataclasses.field(metadata={"unit": unit, "above": above, "below": below})


def file_beside(*, or_none: bool = False) -> Any:
    """Declare the name of a file beside the descriptor; empty where it may be left out."""
    return dataclasses.field(metadata={"beside": True}, default="" if or_none else dataclasses.MISSING)


def one_of(words: tuple[str, ...]) -> Any:
    """Declare a text that is one of these words."""
    return dataclasses.field(metadata={"words": words})


@dataclasses.dataclass(frozen=True)
class Material:
    """An isotropic elastic solid at small strain. youngs : Pa; poisson : below 0.5."""

    youngs: float = number("mpa", above=1e-4, below=100)  # gels and rubbers; outside, another unit is meant (assumed)
    poisson: float = number(above=0, below=0.5)


def required(hint: Any) -> Any:
    """Return the type of a field without the None of one that may be left out."""
    return next((each for each in typing.get_args(hint) if dataclasses.is_dataclass(each)), hint)


def read_table(form: type[_T], content: Any, where: str) -> _T:
    """Convert a table of the file to a dataclass, in SI units. where : of the file, for TactileError"""
    if not isinstance(content, dict):
        raise TactileError(where, repr(content), "a table")
    types = typing.get_type_hints(form)
    fields = {
        key: field for field in dataclasses.fields(form)  # type: ignore[arg-type]
        if (key := _key(field)) in content or field.default is dataclasses.MISSING
    }  # fmt: skip
    check_names(where, content, tuple(fields))
    return form(**{
        field.name: read_value(types[field.name], content[key], f"{where}, {key}", field.metadata)
        for key, field in fields.items()
    })  # fmt: skip


def _key(field: dataclasses.Field) -> str:
    """Return a field's name in the file, which ends in its unit."""
    unit = field.metadata.get("unit")
    return f"{field.name}_{unit}" if unit else field.name


def check_names(where: str, content: dict[str, Any], names: tuple[str, ...]) -> None:
    """Raise TactileError for a field that is missing, unknown or in another unit."""
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
    for unit in sorted((*_UNITS, *_OTHERS), key=len, reverse=True):
        if name.endswith(f"_{unit}"):
            return name.removesuffix(f"_{unit}")
    return name


def read_value(kind: Any, value: Any, where: str, meta: Any) -> Any:
    """Convert a value of the file to a field's type, in SI units. Raises TactileError for a value of another type."""
    if typing.get_origin(kind) is tuple:
        items = typing.get_args(kind)
        length = None if items[-1] is Ellipsis else len(items)
        if not isinstance(value, list) or length not in (None, len(value)):
            raise TactileError(where, repr(value), "a list" if length is None else f"a list of {length}")
        return tuple(read_value(items[0], item, where, meta) for item in value)
    if kind is str:
        words = meta.get("words")
        if not isinstance(value, str) or (words and value not in words):
            raise TactileError(where, repr(value), " or ".join(words) if words else "text")
        if meta.get("beside") and Path(value).name != value:
            raise TactileError(where, repr(value), "the name of a file beside the descriptor")
        return value
    return _number(kind, value, where, meta)


def _number(kind: type[float] | type[int], value: Any, where: str, meta: Any) -> float | int:
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole and (kind is int or not isinstance(value, Decimal)):
        raise TactileError(where, repr(value), "a whole number" if kind is int else "a number")
    above, below, unit = meta["above"], meta["below"], meta["unit"]
    if not above < float(Decimal(value)) < below:  # also refuses nan
        limits = [f"above {above:g}"] * (above > -math.inf) + [f"below {below:g}"] * (below < math.inf)
        finite = [] if Decimal(value).is_finite() and limits else ["a finite number"]
        raise TactileError(where, str(value), " ".join([*finite, " and ".join(limits)]).strip())
    if kind is int:
        return int(value)
    return math.radians(value) if unit == "deg" else float(Decimal(value).scaleb(_UNITS.get(unit, 0)))
