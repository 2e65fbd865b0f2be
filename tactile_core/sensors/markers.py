"""Dots printed on a gel, whose motion in the picture tells how its surface moves sideways."""

from __future__ import annotations

import dataclasses
import math

from ..errors import TactileError

MOST_DOTS = 10_000  # of a grid (assumed enough: 7 x 9 to 20 x 25 are printed)
MOST_LENGTH = 20e-3  # m of pitch or diameter: the gel itself is 18 x 25 mm


@dataclasses.dataclass(frozen=True)
class Markers:
    """A square grid of round dots on the coating, in the middle of the picture. Raises TactileError out of range.

    rows, columns : down the picture and to its right
    pitch, diameter : m, between neighbours' middles, and of a dot
    albedo : share of the coating's light that a dot throws back, 0 black to 1 unseen
    """

    rows: int
    columns: int
    pitch: float
    diameter: float
    albedo: float

    def __post_init__(self) -> None:
        for name in ("rows", "columns"):
            if getattr(self, name) < 1:
                raise TactileError(f"markers, {name}", str(getattr(self, name)), "1 or more")
        if self.count > MOST_DOTS:
            raise TactileError("markers, rows x columns", f"{self.count} dots", f"at most {MOST_DOTS}")
        for name in ("pitch", "diameter"):
            length = getattr(self, name)
            if not (math.isfinite(length) and 0 < length <= MOST_LENGTH):
                expected = f"above 0, at most {1e3 * MOST_LENGTH:g} mm"
                raise TactileError(f"markers, {name}_mm", f"{1e3 * length:g}", expected)
        if not 0 <= self.albedo <= 1:
            raise TactileError("markers, albedo", f"{self.albedo:g}", "0 (black) to 1 (unseen)")

    @property
    def count(self) -> int:
        """Count the dots."""
        return self.rows * self.columns
