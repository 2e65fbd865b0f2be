"""Error that the toolkit itself adds: the bound of ``--error``, rounding, and heights between the nodes."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import re
from typing import Any

import numpy as np

from ..errors import TactileError
from ..files.shipped import shipped
from ..sensors import TARGET, shape_of, title

TABLE = shipped("sampling.json")
EXPECTED = "a number and its unit, such as 5um or 0.6levels, or both: 5um,0.6levels"


@dataclasses.dataclass(frozen=True)
class Budget:
    """Largest acceptable error; None where the user gives no bound.

    um : micrometres rms of a surface, or of a height map; levels : grey levels rms of a picture
    """

    um: float | None = None
    levels: float | None = None

    def __str__(self) -> str:
        """Format the bounds as `parse_budget` reads them."""
        given = {"um": self.um, "levels": self.levels}
        return ",".join(f"{value:g}{unit}" for unit, value in given.items() if value is not None)

    def only(self, unit: str, why: str) -> float:
        """Return the bound in ``unit``; raises TactileError where one is given in the other unit, meaningless here."""
        other = "levels" if unit == "um" else "um"
        if getattr(self, other) is not None:
            raise TactileError("--error", f"{getattr(self, other):g}{other}", f"a bound in {unit}", why)
        return getattr(self, unit)


def parse_budget(text: str) -> Budget:
    """Parse ``"5um"``, ``"0.6levels"`` or ``"5um,0.6levels"``. Raises TactileError for anything else."""
    found: dict[str, float] = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d*\.?\d+(?:e[+-]?\d+)?)\s*(um|µm|μm|levels?)\s*", part, re.IGNORECASE)
        unit = "" if not match else "levels" if match[2].lower().startswith("level") else "um"
        value = float(match[1]) if match else 0.0
        if not match or unit in found or not (value > 0 and math.isfinite(value)):
            raise TactileError("--error", repr(text), EXPECTED, "Give a bound above 0 once for each unit")
        found[unit] = value
    return Budget(**found)


@functools.cache
def measured() -> dict[str, Any]:
    """Read the results of ``scripts/benchmarks/measure_sampling.py``; bins of depth over thickness, m; of one gel."""
    return json.loads(TABLE.read_text(encoding="utf-8"))


def height_error(share: float) -> float:
    """Bound, um rms, for 95 of 100 contacts on a height map's error between nodes, up to a depth over thickness."""
    bins = measured()["bins"]
    reached = [each for each in bins if each["depth_share_to"] < share] + [_bin_of(share)]
    return 1e6 * max(each["rms_95_m"] for each in reached)


def _bin_of(share: float) -> dict[str, float]:
    """The bin of a depth; the deepest beyond it."""
    bins = measured()["bins"]
    return next((each for each in bins if share <= each["depth_share_to"]), bins[-1])


def rounding() -> float:
    """Return the largest change, um, that float32 makes in a translated gel."""
    return 1e6 * measured()["float32_m"]


def check_gel(gel: str) -> None:
    """Raise TactileError for a gel on which the error was not measured."""
    known = measured()["gel"]
    if gel != known:
        found = f"a bound in um on a {title(gel)}, where heights between nodes were not measured"
        raise TactileError("--error", found, f"one on a {title(known)}, or one in levels alone", "Leave out the um")


def check(bound: float, share: float | None) -> str:
    """Describe the error added to a gel; share : the depth over the thickness of its heights, None without heights.

    Raises TactileError where that is more than the bound, um: there is nothing more exact to choose.
    """
    added = rounding() if share is None else height_error(share)
    what = "rounding to float32 adds" if share is None else f"heights between nodes add, {share:.0%} of the gel deep"
    if added > bound:
        raise TactileError("--error", f"{bound:g} um", f"{added:.3g} or more, which {what}", "Allow more")
    return f"{what}: {added:.2g} um, at most {bound:g}; there is nothing to choose"


def depth_share(displacement: np.ndarray, gel: str = TARGET) -> float:
    """Return the largest move of a gel's node in displacements (..., M, 3) m, over the gel's thickness."""
    largest = float(np.sqrt(np.square(displacement, dtype=np.float32).sum(-1).max(initial=0)))
    return largest / shape_of(gel).thickness
