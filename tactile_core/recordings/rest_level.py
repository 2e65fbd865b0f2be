"""Estimate the rest level from the quiet parts of a recording, and the changes against it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .quiet import TARED_PDC, Quiet
from .recording import BLOCK

LOWEST = 1.0  # percentile of PDC that is taken for rest where nothing is quiet: robust as a least value (assumed)


@dataclass(frozen=True, eq=False)
class Baseline:
    """Readings without contact: levels (P, 19) counts at frames (P,), linear between them, constant outside."""

    frames: np.ndarray
    levels: np.ndarray

    @classmethod
    def constant(cls, counts: np.ndarray) -> Baseline:
        """Return the baseline that has the level counts (19,) in every frame."""
        return cls(np.zeros(1), np.asarray(counts, float)[None])

    def at(self, frames: np.ndarray) -> np.ndarray:
        """Return the readings at rest (n, 19) counts, for frames (n,); read-only."""
        if len(self.levels) == 1:
            return np.broadcast_to(self.levels[0], (len(frames), self.levels.shape[1]))
        return np.column_stack([np.interp(frames, self.frames, column) for column in self.levels.T])


class Changes:
    """Changes (T, e) counts against rest, indexed like an array and computed when they are read, as all of them would
    take twice a recording's memory. count : T; of : function from frames (n,) to their changes (n, e)"""

    def __init__(self, count: int, of: Callable[[np.ndarray], np.ndarray]) -> None:
        self._count, self._of = count, of

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, rows: slice | np.ndarray) -> np.ndarray:
        frames = np.arange(*rows.indices(self._count)) if isinstance(rows, slice) else rows
        first = self._of(frames[:BLOCK])
        if len(frames) <= BLOCK:
            return first
        found = np.empty((len(frames), first.shape[1]))
        found[:BLOCK] = first
        for start in range(BLOCK, len(frames), BLOCK):
            found[start : start + BLOCK] = self._of(frames[start : start + BLOCK])
        return found

    def then(self, function: Callable[[np.ndarray], np.ndarray]) -> Changes:
        """Return these changes with a function (n, e) -> (n, e) applied to them, frame by frame, when they are read."""
        return Changes(self._count, lambda frames: function(self._of(frames)))


Framewise = np.ndarray | Changes


def baseline(electrodes: np.ndarray, quiet: Quiet, drift: bool) -> Baseline:
    """Return what electrodes (T, 19) counts would read without contact, from the quiet parts. drift : true takes each
    part's level, linear between the parts' middles and constant outside, where nothing is known; false takes one level
    of all quiet frames"""
    if not drift or len(quiet.parts) < 2:
        return Baseline.constant(level(electrodes[quiet.mask]))
    middles = np.array([0.5 * (a + b - 1) for a, b in quiet.parts])
    return Baseline(middles, np.array([level(electrodes[a:b]) for a, b in quiet.parts]))


def pressure_rest(pdc: np.ndarray, kind: str, quiet: Quiet) -> float:
    """Return pdc (T,) at rest, counts: 0 if it was tared (low, and not "raw"), else of quiet frames, or its lowest."""
    finite = pdc[np.isfinite(pdc)]
    if not len(finite) or (kind != "raw" and np.median(finite) < TARED_PDC):
        return 0.0
    still = pdc[quiet.mask & np.isfinite(pdc)]
    return float(np.median(still)) if len(still) else float(np.percentile(finite, LOWEST))


def level(samples: np.ndarray) -> np.ndarray:
    """Return the mean (19,) of the middle half of samples (n, 19): as robust as the median, but finer than a count."""
    cut = len(samples) // 4
    return np.sort(samples, axis=0)[cut : len(samples) - cut].mean(axis=0, dtype=float)
