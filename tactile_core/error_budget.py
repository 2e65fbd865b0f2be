"""How exact is exact enough: bounds as a user writes them, and the cheapest way that meets one.

A bound is on what the toolkit adds (solver, mesh, sampling, shading), against its own reference; what the translation
from signals leaves is never counted in it.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from .errors import TactileError

EXPECTED = "a number and its unit, such as 5um or 0.6levels, or both: 5um,0.6levels"


@dataclasses.dataclass(frozen=True)
class Budget:
    """The largest error that will do; None where the user does not say.

    um : micrometres rms of a surface, or of a height map; levels : grey levels rms of a picture
    """

    um: float | None = None
    levels: float | None = None

    def __str__(self) -> str:
        """As `parse` reads it."""
        given = {"um": self.um, "levels": self.levels}
        return ",".join(f"{value:g}{unit}" for unit, value in given.items() if value is not None)

    def only(self, unit: str, why: str) -> float:
        """The bound in one unit, where the other has no meaning. Raises TactileError where it is asked for."""
        other = "levels" if unit == "um" else "um"
        if getattr(self, other) is not None:
            raise TactileError("--error", f"{getattr(self, other):g}{other}", f"a bound in {unit}", why)
        return getattr(self, unit)


def parse(text: str) -> Budget:
    """``"5um"``, ``"0.6levels"`` or ``"5um,0.6levels"``. Raises TactileError for anything else."""
    found: dict[str, float] = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d*\.?\d+(?:e[+-]?\d+)?)\s*(um|µm|μm|levels?)\s*", part, re.IGNORECASE)
        unit = "" if not match else "levels" if match[2].lower().startswith("level") else "um"
        value = float(match[1]) if match else 0.0
        if not match or unit in found or not (value > 0 and math.isfinite(value)):
            raise TactileError("--error", repr(text), EXPECTED, "Give a bound above 0 once for each unit")
        found[unit] = value
    return Budget(**found)


class Candidate(NamedTuple):
    """One way to do it: its measured error, in the unit of the bound, and what it costs, ms."""

    name: str
    error: float
    ms: float


def cheapest(candidates: Sequence[Candidate], bound: float, unit: str, what: str = "") -> Candidate:
    """The candidate of least cost whose error is at most the bound; what : of which they are, for the message.

    Raises TactileError, naming the best there is, where none is.
    """
    good = [each for each in candidates if each.error <= bound]
    if not good:
        best = min(candidates, key=lambda each: each.error)
        found = f"{bound:g} {unit}" + (f" of {what}" if what else "")
        raise TactileError("--error", found, f"{best.error:.3g} or more, which {best.name} has", "Allow more")
    return min(good, key=lambda each: each.ms)
