"""Detect faulty electrodes: readings at an end of the converter's range, and dead channels."""

from __future__ import annotations

import numpy as np

from ..sensors import COUNT_MAX
from .flags import Flag
from .recording import Recording

DEAD_FRAMES = 100  # a channel with 0.7-1.5 counts of noise does not stand still for 1 s
# counts that the others' median moves by meanwhile; units with less noise stand still in steady grips, as long as
# nothing moves: by 4 and less in 36 such grips (PHAC, trials 01 to 03)
STEADY = 6.0
NOISY = 0.3  # share of the samples that differ from the one before: 0.6 at 0.7 counts of noise (assumed: half of it)


def saturated(recording: Recording, readings: np.ndarray, kind: str, warnings: list[str]) -> np.ndarray:
    """Return the flags (T,) of raw readings at an end of the 12-bit range; other kinds do not show it.

    readings : (T, 19) counts; findings are added to the warnings
    """
    if kind != "raw":
        return np.zeros(len(readings), np.uint16)
    ends = (readings <= 0) | (readings >= COUNT_MAX)
    frames = np.flatnonzero(ends.any(axis=1))
    if len(frames):
        warnings.append(
            f"{named_electrodes(ends.any(axis=0))} at an end of the 12-bit range in {len(frames)} frames, first in "
            f"{recording.row_word} {recording.rows[frames[0]]}"
        )
    return np.where(ends.any(axis=1), Flag.SATURATED, 0).astype(np.uint16)


def dead(recording: Recording, readings: np.ndarray, warnings: list[str]) -> np.ndarray:
    """Return the flags (T,) where an electrode is constant for 1 s or more; none in recordings that are shorter.

    readings : (T, 19) counts; findings are added to the warnings
    """
    still = _still(readings)
    whole = still.all(axis=0)
    if whole.any():
        warnings.append(f"{named_electrodes(whole)} never changes: dead channel")
    for j in np.flatnonzero(still.any(axis=0) & ~whole):
        frames = np.flatnonzero(still[:, j])
        warnings.append(
            f"E{j + 1} stands still in {len(frames)} frames, first in {recording.row_word} "
            f"{recording.rows[frames[0]]}: dead channel"
        )
    return np.where(still.any(axis=1), Flag.DEAD_CHANNEL, 0).astype(np.uint16)


def _still(readings: np.ndarray) -> np.ndarray:
    """Mark (T, 19) bool the samples of runs of ``DEAD_FRAMES`` or more equal readings.

    Runs while no electrode changes are no fault unless they span the whole recording. For an electrode that is quiet
    elsewhere too, missing noise shows nothing: only a run over the whole recording counts.
    """
    still = np.zeros(readings.shape, bool)
    for j in range(readings.shape[1]):
        change = np.diff(readings[:, j]) != 0
        bounds = np.r_[0, np.flatnonzero(change) + 1, len(readings)]
        for first, last in zip(bounds, bounds[1:], strict=False):
            if last - first >= DEAD_FRAMES and (last - first == len(readings) or _moves(readings[first:last])):
                still[first:last, j] = True
        moving = ~still[1:, j]
        if moving.any() and change[moving].mean() < NOISY:
            still[:, j] = False
    return still


def _moves(readings: np.ndarray) -> bool:
    """Return true if half of the electrodes of readings (T, 19) change by more than `STEADY`."""
    return bool(np.median(np.ptp(readings, axis=0)) > STEADY)


def named_electrodes(mask: np.ndarray | np.bool) -> str:
    """Name the electrodes of a mask (19,) bool: ``"E3, E7"``."""
    return ", ".join(f"E{j + 1}" for j in np.flatnonzero(mask))
