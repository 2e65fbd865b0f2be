"""A scene over a grid of parameters: `NAME=A:B:N` (N values from A to B, evenly) or `NAME=V,V,...`, all combinations.

NAME is a field of the scene as its TOML has it, with numbers for places in lists (``recording.tilt_deg``,
``indenters.0.radius_mm``), or one of three that change the whole motion of the [recording]:
``force_n``  its greatest force, N: all forces are scaled
``x_mm``, ``z_mm``  where it is pressed hardest: all points are moved
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from ..errors import TactileError
from .scene import Scene, check

MOST = 100_000  # combinations (assumed to be more than anyone simulates)
MOTION = ("force_n", "x_mm", "z_mm")
FORM = "NAME=A:B:N or NAME=V,V,..."
Value = float | str


def combinations(words: Sequence[str]) -> list[dict[str, Value]]:
    """List all combinations, the last name's values changing fastest. Raises TactileError for a bad or doubled word."""
    axes: dict[str, list[Value]] = {}
    for word in words:
        name, mark, text = word.partition("=")
        if not mark or not re.fullmatch(r"[a-z_0-9]+(\.[a-z_0-9]+)*", name):
            raise TactileError("--grid", repr(word), FORM, "Such as force_n=0.2:2:5")
        if name in axes:
            raise TactileError("--grid", f"{name} twice", "each name once")
        axes[name] = _values(word, text)
    count = int(np.prod([float(len(values)) for values in axes.values()]))
    if count > MOST:
        raise TactileError("--grid", f"{count:,} combinations", f"at most {MOST:,}", "Split it")
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _values(word: str, text: str) -> list[Value]:
    steps = re.fullmatch(r"([^:,]+):([^:,]+):(\d{1,6})", text)
    if steps:
        low, high, count = _number(word, steps[1]), _number(word, steps[2]), int(steps[3])
        if not 1 <= count <= MOST:
            raise TactileError("--grid", repr(word), f"1 to {MOST:,} values")
        # Ten digits, so that 0.1:0.3:3 holds 0.2 and not 0.2 and a bit, which would stand in the file names.
        return [float(f"{value:.10g}") for value in np.linspace(low, high, count)]
    values = [part.strip() for part in text.split(",")]
    if not all(values) or ":" in text:
        raise TactileError("--grid", repr(word), FORM, "Such as force_n=0.2:2:5")
    return [_number(word, value) if _is_number(value) else value for value in values]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(word: str, text: str) -> float:
    value = float(text) if _is_number(text) else np.nan
    if not np.isfinite(value):
        raise TactileError("--grid", repr(word), "finite numbers")
    return value


def name_of(values: dict[str, Value]) -> str:
    """Make a file name from the values: ``force_n-0.2_tilt_deg-10``."""
    parts = [
        f"{name.rpartition('.')[2]}-{value:g}" if isinstance(value, float) else value for name, value in values.items()
    ]
    return re.sub(r"[^A-Za-z0-9._-]", "_", "_".join(parts))[:80] or "scene"


def with_values(scene: Scene, values: dict[str, Value], where: str) -> Scene:
    """Return the scene with other values. Raises TactileError for a field it has not, or a value out of its range."""
    document = msgspec.to_builtins(scene)
    for name, value in values.items():
        if name in MOTION:
            _move(document, name, value, where)
        else:
            _set(document, name, value, where)
    try:
        changed = msgspec.convert(document, Scene)
    except msgspec.ValidationError as error:
        raise TactileError(where, str(error), "values that the scene's fields allow", "Change --grid") from error
    check(where, changed)
    return changed


def _set(document: dict[str, Any], name: str, value: Value, where: str) -> None:
    *path, last = name.split(".")
    place: Any = document
    try:
        for step in path:
            place = place[int(step)] if isinstance(place, list) else place[step]
        key = int(last) if isinstance(place, list) else last
        old = place[key]
    except (KeyError, IndexError, ValueError, TypeError) as error:
        raise TactileError(f"{where}, {name}", "no such field", "a field of the scene", "Compare its TOML") from error
    if isinstance(old, dict | list):
        raise TactileError(f"{where}, {name}", "a table or list", "a number or a word", "Name a field in it")
    place[key] = value


def _move(document: dict[str, Any], name: str, value: Value, where: str) -> None:
    points = (document["recording"] or {}).get("points", [])
    hardest = max(points, key=lambda point: point["force_n"], default={"force_n": 0.0})
    if not hardest["force_n"] > 0 or not isinstance(value, float):
        raise TactileError(f"{where}, {name}", "no motion that presses", "a [recording] with force, and a number")
    if name == "force_n":
        factor = value / hardest["force_n"]
        for point in points:
            point["force_n"] *= factor
    else:
        shift = value - hardest[name]
        for point in points:
            point[name] += shift
