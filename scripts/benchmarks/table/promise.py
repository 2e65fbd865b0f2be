"""A stated bound beside the measured error, over many contacts or frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_core.accuracy import Row, row

COVER = 0.9, 0.98  # share of contacts below a bound of 95 %, between which it counts as right (assumed)
FEWEST = 200  # contacts: of fewer, such a share is 1.5 % off and more by chance, and has no target


@dataclass(frozen=True)
class Promise:
    """Bounds that 95 of 100 should stay below, and what was found, in ``unit``; groups : (C,) what each belongs to."""

    name: str
    unit: str
    bound: np.ndarray
    found: np.ndarray
    groups: Sequence[str]
    of: str

    def covered(self, among: np.ndarray | None = None) -> float:
        """Share of all, or of a mask's, that stayed below."""
        held = self.found <= self.bound
        return float((held if among is None else held[among]).mean())

    def row(self) -> Row:
        """Coverage, with its target where there are enough contacts."""
        share = self.covered()
        if len(self.found) < FEWEST:
            return row(f"promised_{self.name}_covered", share, "1", of=self.of)
        return row(f"promised_{self.name}_covered", share, "1", COVER[0], of=self.of, at_least=True) | {
            "ok": COVER[0] <= share <= COVER[1]
        }

    def lines(self) -> Iterator[str]:
        """Lines of a table: all, then each group."""
        names = np.array(self.groups)
        for name in ["all", *dict.fromkeys(self.groups)]:
            here = np.ones(len(names), bool) if name == "all" else names == name
            bound, found = (f"{np.median(values[here]):.3g} {self.unit}" for values in (self.bound, self.found))
            yield f"| {self.name} | {name} | {here.sum()} | {bound} | {found} | {self.covered(here):.1%} |"


TABLE = "| what | among | contacts | bound, median | measured, median | below the bound |\n|---|---|---|---|---|---|"
