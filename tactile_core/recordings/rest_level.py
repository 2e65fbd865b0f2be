"""Find the parts of a recording without contact, wherever they lie, the rest level from them, and changes from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import TactileError

WINDOW = 0.3  # s, the shortest part that is called quiet; 30 frames bring 1.5 counts of noise down to 0.3
FEWEST = 8  # frames of a window, at slow rates
# Counts within a window: noise is 0.7-1.5 (docs/sources.md), plus 4 deviations of its estimate from 30 samples.
CALM_STD = 2.4
CALM_TREND = 2.5  # counts from the first to the second half of a window: 4 deviations of that difference at 1.5 counts
QUIET_PDC = 2.0  # counts over rest (a tare is right below 2: docs/sources.md, BioTac read-out)
RECTIFIED_LEVEL = 4.0  # counts; without PDC a quiet electrode of a rectified recording stays below (noise folds to 1.2)
RECTIFIED_LEVEL_PDC = 15.0  # counts; where PDC says that nothing touches, the rest is drift since the tare (assumed)
# Counts and counts/s by which two quiet parts may differ (Ruppel: 88 counts an hour = 0.024/s).
LEVEL, LEVEL_RATE = 3.0, 0.1
LEVEL_PDC, LEVEL_PDC_RATE = 15.0, 0.2  # the same where PDC confirms both (assumed: skin creep after a contact)
PDC_RATE = 0.1  # counts/s of drift allowed to PDC itself (assumed as for electrodes)
TRACKED = 60.0  # s; over longer times drift is followed, or it would come to be as large as a press (assumed)
TARED_LEVEL = 15.0  # counts that rest may have drifted from a tared file's own zero (assumed)
TARED_PDC = 500.0  # counts; a lower median PDC has been tared too, so that its zero means no contact (assumed)
LOWEST = 1.0  # percentile of PDC that is taken for rest where nothing is quiet: robust as a least value (assumed)
BLOCK = 2**14  # frames whose changes are made at a time, which bounds the memory of a long recording
NEAR_END = 0.5  # s; a calm part this near to the start or end of a recording is preferred as rest


@dataclass(frozen=True, eq=False)
class Quiet:
    """Quiet parts; mask : (T,) bool; parts : first and one-past-last frame of each quiet part; evidence in words."""

    mask: np.ndarray
    parts: tuple[tuple[int, int], ...]
    evidence: str


@dataclass(frozen=True, eq=False)
class _Windows:
    """Statistics of all windows of n frames, by start frame: sums (W, 19), calm, pdc or None, middle (s) (W,).

    The sums are in single precision where that is exact, as it is of counts: in double they are twice the recording.
    """

    n: int
    sums: np.ndarray
    calm: np.ndarray
    pdc: np.ndarray | None
    middle: np.ndarray

    def mean_of(self, electrode: int) -> np.ndarray:
        """Return the means (W,) of one electrode."""
        return self.sums[:, electrode].astype(float) / self.n

    def mean_at(self, window: int) -> np.ndarray:
        """Return the means (19,) of one window."""
        return self.sums[window].astype(float) / self.n

    def largest(self, change: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return the largest (W,) of what the electrodes' means (W,) are changed to."""
        found = change(self.mean_of(0))
        for electrode in range(1, self.sums.shape[1]):
            np.maximum(found, change(self.mean_of(electrode)), out=found)
        return found


def window_frames(rate: float) -> int:
    """Return the number of frames of the tare window at this rate (Hz)."""
    return max(FEWEST, round(WINDOW * rate))


def find_quiet(electrodes: np.ndarray, pdc: np.ndarray | None, rate: float, kind: str) -> Quiet:
    """Find quiet parts: calm in every electrode, at the rest level, and with the fluid pressure (PDC) of rest.

    electrodes : (T, 19) float, counts, repaired; pdc : (T,) float, counts, or None; rate in Hz.

    A held press is calm too. PDC separates it from rest: the fluid pressure is lowest without contact. Without PDC,
    calm parts near the start or end are taken for rest, and others must agree with them. In tared recordings rest is
    near zero.
    Known limit: a raw recording of one steady contact from its first frame to its last looks like rest.
    """
    n = window_frames(rate)
    if len(electrodes) < n:
        return Quiet(
            np.zeros(len(electrodes), bool), (), f"{len(electrodes)} frames are fewer than the {n} of the tare window"
        )
    windows = _running(electrodes, pdc if pdc is not None and np.isfinite(pdc).all() else None, n, rate)
    accepted = _rest_rectified(windows) if kind == "rectified" else _rest_signed(windows, kind, len(electrodes) / rate)
    mask = np.zeros(len(electrodes), bool)
    for start in np.flatnonzero(accepted):
        mask[start : start + n] = True
    parts = _runs(mask)
    by = "calm electrodes and the lowest PDC" if windows.pdc is not None else "calm electrodes (no PDC to confirm it)"
    evidence = f"{len(parts)} quiet part{'s' * (len(parts) != 1)} ({by})" if parts else "no calm part at the rest level"
    return Quiet(mask, parts, evidence)


def calmest(electrodes: np.ndarray, pdc: np.ndarray | None, rate: float) -> slice:
    """Return the window for rest where nothing is quiet: of lowest PDC if there is one, else of least movement."""
    n = min(window_frames(rate), len(electrodes))
    windows = _running(electrodes, pdc if pdc is not None and np.isfinite(pdc).all() else None, n, rate)
    if windows.pdc is not None:
        start = int(np.argmin(windows.pdc))
    else:
        start = int(np.argmin(np.max([_spread(column.astype(float), n) for column in electrodes.T], axis=0)))
    return slice(start, start + n)


@dataclass(frozen=True, eq=False)
class Baseline:
    """Readings without contact: levels (P, 19) counts at frames (P,), linear between them, constant outside."""

    frames: np.ndarray
    levels: np.ndarray

    @classmethod
    def constant(cls, counts: np.ndarray) -> Baseline:
        """Make the baseline that is at counts (19,) in every frame."""
        return cls(np.zeros(1), np.asarray(counts, float)[None])

    def at(self, frames: np.ndarray) -> np.ndarray:
        """Return the readings (n, 19) counts, not to be written to, in frames (n,)."""
        if len(self.levels) == 1:
            return np.broadcast_to(self.levels[0], (len(frames), self.levels.shape[1]))
        found = np.empty((len(frames), self.levels.shape[1]))
        for j, levels in enumerate(self.levels.T):
            found[:, j] = np.interp(frames, self.frames, levels)
        return found


class Changes:
    """Changes (T, e) counts, indexed like an array: of all frames of a long recording they take twice its memory.

    count : T; of : frames (n,) -> their changes (n, e)
    """

    def __init__(self, count: int, of: Callable[[np.ndarray], np.ndarray]) -> None:
        self._count, self._of = count, of

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, rows: slice | np.ndarray) -> np.ndarray:
        frames = np.arange(self._count)[rows] if isinstance(rows, slice) else rows
        first = self._of(frames[:BLOCK])
        if len(frames) <= BLOCK:
            return first
        found = np.empty((len(frames), first.shape[1]))
        found[:BLOCK] = first
        for start in range(BLOCK, len(frames), BLOCK):
            found[start : start + BLOCK] = self._of(frames[start : start + BLOCK])
        return found

    def then(self, function: Callable[[np.ndarray], np.ndarray]) -> Changes:
        """Return these changes (n, e) converted by a function that takes each frame by itself."""
        return Changes(self._count, lambda frames: function(self._of(frames)))


Framewise = np.ndarray | Changes


def baseline(electrodes: np.ndarray, quiet: Quiet, drift: bool) -> Baseline:
    """Estimate the readings (T, 19) counts without contact.

    Level of each quiet part, linear between their middles, constant before the first and after the last: nothing is
    known there, and contact is never taken for drift. Without drift: one level over all quiet frames.
    """
    if not drift or len(quiet.parts) < 2:
        return Baseline.constant(level(electrodes[quiet.mask]))
    middles = np.array([0.5 * (a + b - 1) for a, b in quiet.parts])
    return Baseline(middles, np.array([level(electrodes[a:b]) for a, b in quiet.parts]))


def pressure_rest(pdc: np.ndarray, kind: str, quiet: Quiet) -> float:
    """Return PDC at rest, counts: 0 for a tared file; else the quiet frames', or the lowest where there are none."""
    finite = pdc[np.isfinite(pdc)]
    if not len(finite) or (kind != "raw" and np.median(finite) < TARED_PDC):
        return 0.0
    still = pdc[quiet.mask & np.isfinite(pdc)]
    return float(np.median(still)) if len(still) else float(np.percentile(finite, LOWEST))


def level(samples: np.ndarray) -> np.ndarray:
    """Return the mean (19,) of the middle half of (n, 19) samples: robust like the median, but not whole counts."""
    cut = len(samples) // 4
    return np.sort(samples, axis=0)[cut : len(samples) - cut].mean(axis=0, dtype=float)


def _sums(values: np.ndarray, n: int) -> np.ndarray:
    total = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    return total[n:] - total[:-n]


def _spread(values: np.ndarray, n: int) -> np.ndarray:
    """Standard deviation (W,) of values (T,) within each window."""
    centred = values - np.median(values)  # keeps the squares small
    mean = _sums(centred, n) / n
    return np.sqrt(np.maximum(_sums(centred**2, n) / n - mean**2, 0.0))


def _running(electrodes: np.ndarray, pdc: np.ndarray | None, n: int, rate: float) -> _Windows:
    half = max(1, n // 2)
    count = len(electrodes) - n + 1
    sums, calm = np.zeros((count, electrodes.shape[1]), np.float32), np.ones(count, bool)
    for j, column in enumerate(electrodes.T):  # one at a time: sums of all would take seven times the recording
        column = column.astype(float)
        halves = _sums(column, half) / half
        trend = halves[n - half : n - half + count] - halves[:count]
        calm &= (_spread(column, n) <= CALM_STD) & (np.abs(trend) <= CALM_TREND)
        total = _sums(column, n)
        if sums.dtype == np.float32 and not np.array_equal(total, total.astype(np.float32)):
            sums = sums.astype(float)
        sums[:, j] = total
    pressure = _sums(pdc, n) / n if pdc is not None else None
    return _Windows(n, sums, calm, pressure, (np.arange(count) + 0.5 * (n - 1)) / rate)


def _rest_rectified(windows: _Windows) -> np.ndarray:
    """Mark windows (W,) bool at rest. Rectified readings are zero at the tare, so rest is small and calm."""
    largest = windows.largest(lambda mean: mean)
    if windows.pdc is None:
        return windows.calm & (largest <= RECTIFIED_LEVEL)
    return windows.calm & (windows.pdc < QUIET_PDC) & (largest <= RECTIFIED_LEVEL_PDC)


def _rest_signed(windows: _Windows, kind: str, duration: float) -> np.ndarray:
    """Mark windows (W,) bool at rest: one calm window is chosen, with all calm ones that agree with it."""
    possible = windows.calm
    if kind != "raw":
        possible = possible & (windows.largest(np.abs) <= TARED_LEVEL)
        if windows.pdc is not None and np.median(windows.pdc) < TARED_PDC:
            possible &= windows.pdc < QUIET_PDC
    calm = np.flatnonzero(possible)
    if len(calm) == 0:
        return possible
    anchor = _anchor(windows, calm, kind, duration)
    apart = np.abs(windows.middle - windows.middle[anchor])
    off = windows.largest(lambda mean: np.abs(mean - mean[anchor]))
    if windows.pdc is None:
        agree = possible & (off <= LEVEL + LEVEL_RATE * apart)
        return agree & _tracked(windows.mean_at, windows.middle, agree, anchor, LEVEL, LEVEL_RATE)
    pressure, pressures = windows.pdc - windows.pdc[anchor], windows.pdc[:, None]
    agree = possible & (pressure < QUIET_PDC + PDC_RATE * apart) & (off <= LEVEL_PDC + LEVEL_PDC_RATE * apart)
    agree &= _tracked(windows.mean_at, windows.middle, agree, anchor, LEVEL_PDC, LEVEL_PDC_RATE)
    return agree & _tracked(lambda window: pressures[window], windows.middle, agree, anchor, QUIET_PDC, PDC_RATE)


def _tracked(
    values: Callable[[int], np.ndarray],
    middle: np.ndarray,
    possible: np.ndarray,
    anchor: int,
    level: float,
    rate: float,
) -> np.ndarray:
    """Mark windows (W,) bool whose values, (C,) of each, lie near a level that follows them from the anchor on.

    The level moves at ``rate`` a second at most: drift over an hour can exceed a press.
    """
    accepted = np.ones(len(middle), bool)
    if np.abs(middle - middle[anchor]).max() <= TRACKED:
        return accepted
    candidates = np.flatnonzero(possible)
    for way in (candidates[candidates >= anchor], candidates[candidates < anchor][::-1]):
        now, last = values(anchor), middle[anchor]
        for k in way:
            since, off = abs(middle[k] - last), values(k) - now
            accepted[k] = np.abs(off).max() <= level + rate * (since + TRACKED)
            if accepted[k]:
                now, last = now + np.clip(off, -rate * since, rate * since), middle[k]
    return accepted


def _anchor(windows: _Windows, calm: np.ndarray, kind: str, duration: float) -> int:
    if windows.pdc is not None:
        low = windows.pdc[calm]
        calm = calm[low <= low.min() + 0.5 * QUIET_PDC]
    if kind != "raw":
        return int(calm[np.argmin(windows.largest(np.abs)[calm])])
    early = windows.middle[calm] <= NEAR_END + 0.5 * WINDOW
    late = windows.middle[calm] >= duration - NEAR_END - 0.5 * WINDOW
    if early.any():
        return int(calm[0])
    return int(calm[-1]) if late.any() else int(calm[0])


def _runs(mask: np.ndarray) -> tuple[tuple[int, int], ...]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return tuple((int(a), int(b)) for a, b in edges.reshape(-1, 2))


def tare_frames(asked: slice | str, count: int) -> slice:
    """Convert the tare frames to a plain slice. Raises TactileError where they are not inside these `count` frames."""
    if isinstance(asked, slice):
        tare = asked
    else:
        ends = asked.split(":")
        try:
            tare = slice(*(int(end) if end.strip() else None for end in ends))
        except (ValueError, TypeError):
            ends = []
        if len(ends) != 2:
            raise TactileError("option tare", repr(asked), "frames A:B, such as 0:50, or 'none'")
    first = 0 if tare.start is None else tare.start + (count if tare.start < 0 else 0)
    last = count if tare.stop is None else tare.stop + (count if tare.stop < 0 else 0)
    if tare.step not in (None, 1) or not 0 <= first < last <= count:
        raise TactileError(
            "option tare",
            f"frames {asked if isinstance(asked, str) else f'{tare.start}:{tare.stop}'}",
            f"A:B inside {count} frames, without a step",
            "Name frames without contact",
        )
    return slice(first, last)
