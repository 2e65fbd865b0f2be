"""Bound on the error that the toolkit itself adds, as the option ``--error`` states it."""

from __future__ import annotations

import dataclasses
import math
import re

from ..errors import TactileError

EXPECTED = "a number and its unit, such as 5um or 0.6levels, or both: 5um,0.6levels"


@dataclasses.dataclass(frozen=True)
class Budget:
    """Largest acceptable error, None without a bound. um : rms of a surface; levels : rms grey levels of a picture"""

    um: float | None = None
    levels: float | None = None

    def __str__(self) -> str:
        """Return the bounds as text that `parse_budget` reads."""
        given = {"um": self.um, "levels": self.levels}
        return ",".join(f"{value:g}{unit}" for unit, value in given.items() if value is not None)

    def only(self, unit: str, advice: str) -> float:
        """Return the bound in ``unit``, "um" or "levels". Raises TactileError, with advice, for one in the other."""
        other = "levels" if unit == "um" else "um"
        if getattr(self, other) is not None:
            raise TactileError("--error", f"{getattr(self, other):g}{other}", f"a bound in {unit}", advice)
        return getattr(self, unit)


def parse_budget(text: str) -> Budget:
    """Return the bounds in ``"5um"``, ``"0.6levels"`` or ``"5um,0.6levels"``. Raises TactileError for other texts."""
    found: dict[str, float] = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d*\.?\d+(?:e[+-]?\d+)?)\s*(um|µm|μm|levels?)\s*", part, re.IGNORECASE)
        unit = "" if not match else "levels" if match[2].lower().startswith("level") else "um"
        value = float(match[1]) if match else 0.0
        if not match or unit in found or not (value > 0 and math.isfinite(value)):
            raise TactileError("--error", repr(text), EXPECTED, "Give a bound above 0 once for each unit")
        found[unit] = value
    return Budget(**found)
