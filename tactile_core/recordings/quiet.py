"""Find the parts of a recording without contact, wherever they lie."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import TactileError
from .electrode_faults import runs
from .recording import BLOCK

WINDOW = 0.3  # s, the shortest part that is called quiet; 30 frames bring 1.5 counts of noise down to 0.3
FEWEST = 8  # frames of a window, at slow rates
# Counts of noise: 0.7-1.5 (docs/sources.md); a driver that sends steps of 4 to 10 counts has 3 to 5. More is movement.
NOISE, NOISIEST = 1.5, 7.0
# Largest standard deviation within a calm window, over the noise: 4 standard errors of 30 samples above 1; and largest
# difference between the means of its halves: 4 standard errors.
CALM_STD, CALM_TREND = 1.6, 2.5 / 1.5
# Windows by which noise is judged, and the share of them taken for calm (assumed); frames between samples of it whose
# noise is independent even where a driver repeats every reading once or twice.
LOOKED_AT, CALMER, APART = 2000, 0.3, 3
QUIET_PDC = 2.0  # counts over rest (a tare is right below 2: docs/sources.md, BioTac read-out)
RECTIFIED_LEVEL = 4.0  # counts; without PDC a quiet electrode of a rectified recording stays below (noise folds to 1.2)
RECTIFIED_LEVEL_PDC = 15.0  # counts; where PDC says that nothing touches, the rest is drift since the tare (assumed)
# Counts and counts/s by which two quiet parts may differ (Ruppel: 88 counts per hour = 0.024/s). After a contact they
# differ by up to 20 (plate 15330): the skin, which creeps, is dented still.
LEVEL, LEVEL_RATE = 3.0, 0.1
PDC_RATE = 0.1  # counts/s of drift allowed to PDC itself (assumed as for electrodes)
TRACKED = 60.0  # s; in longer recordings the level follows drift, which may exceed a press (assumed)
TARED_LEVEL = 15.0  # counts that rest may have drifted from a tared file's own zero (assumed)
TARED_PDC = 500.0  # counts; a PDC of lower median was tared too: its zero means no contact (assumed)
STRETCH = 256  # windows compared with a level at a time
NEAR_END = 0.5  # s; a calm part this near to the start or end of a recording is preferred as rest


@dataclass(frozen=True, eq=False)
class Quiet:
    """Quiet parts of a recording. mask : (T,) bool, true in them; parts : first frame, and one past the last, of each
    evidence : how they were found, in words"""

    mask: np.ndarray
    parts: tuple[tuple[int, int], ...]
    evidence: str


@dataclass(frozen=True, eq=False)
class _Windows:
    """Statistics of all W windows of n consecutive frames of a recording, by first frame.
    sums : (19, W) of counts; calm : (W,) bool
    pdc : (W,) mean counts, or None; middle : (W,) s, time of the window's middle"""

    n: int
    sums: np.ndarray
    calm: np.ndarray
    pdc: np.ndarray | None
    middle: np.ndarray

    def largest(self, change: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return the largest value (W,) over the electrodes of change(means), means (W,) counts in each window."""
        found = change(self.sums[0] / self.n)
        for sums in self.sums[1:]:
            np.maximum(found, change(sums / self.n), out=found)
        return found


def window_frames(rate: float) -> int:
    """Return the number of frames in the shortest part that is called quiet, at this rate (Hz)."""
    return max(FEWEST, round(WINDOW * rate))


def find_quiet(electrodes: np.ndarray, pdc: np.ndarray | None, rate: float, kind: str) -> Quiet:
    """Return the parts that are calm in every electrode, at the level of rest, and at the fluid pressure (PDC) of rest.

    electrodes : (T, 19) counts, repaired; pdc : (T,) counts, or None; rate : Hz
    kind : "raw", "tared", "scaled" or "rectified"
    A held press is calm too, but its PDC is higher than without contact. Without PDC, calm parts near the start or end
    are taken for rest, and others must agree with them. In tared recordings rest is near zero.
    Known limit: a raw recording of one steady contact from its first frame to its last looks like rest."""
    n = window_frames(rate)
    if len(electrodes) < n:
        return Quiet(
            np.zeros(len(electrodes), bool), (), f"{len(electrodes)} frames are fewer than the {n} of the tare window"
        )
    windows = _running(electrodes, pdc if pdc is not None and np.isfinite(pdc).all() else None, n, rate)
    accepted = _rest_rectified(windows) if kind == "rectified" else _rest_signed(windows, kind, len(electrodes) / rate)
    ends = np.zeros(len(electrodes) + 1, np.int8)  # 1 where the first window over a frame begins, -1 behind the last
    ends[:-n] += accepted
    ends[n:] -= accepted
    mask = np.cumsum(ends[:-1]) > 0
    parts = tuple(runs(mask))
    by = "calm electrodes and the lowest PDC" if windows.pdc is not None else "calm electrodes (no PDC to confirm it)"
    evidence = f"{len(parts)} quiet part{'s' * (len(parts) != 1)} ({by})" if parts else "no calm part at the rest level"
    return Quiet(mask, parts, evidence)


def calmest(electrodes: np.ndarray, pdc: np.ndarray | None, rate: float) -> slice:
    """Return the frames to take rest from if nothing is quiet: the window of lowest PDC or, without PDC, of least
    movement. electrodes : (T, 19) counts; pdc : (T,) counts, or None; rate : Hz"""
    n = min(window_frames(rate), len(electrodes))
    if pdc is not None and np.isfinite(pdc).all():
        start = int(np.argmin(_sums(pdc, n)))
    else:
        start = int(np.argmin(np.max([_spread(column - np.median(column), n) for column in electrodes.T], axis=0)))
    return slice(start, start + n)


def _sums(values: np.ndarray, n: int) -> np.ndarray:
    """Return the sums (..., W) over all windows of n of values (..., T)."""
    total = np.zeros((*values.shape[:-1], values.shape[-1] + 1))
    np.cumsum(values, axis=-1, out=total[..., 1:])
    return total[..., n:] - total[..., :-n]


def _spread(centred: np.ndarray, n: int) -> np.ndarray:
    """Return the standard deviation (..., W) in windows of n values; centred : (..., T), values near 0"""
    mean = _sums(centred, n) / n
    return np.sqrt(np.maximum(_sums(np.square(centred), n) / n - np.square(mean), 0.0))


def _noise(electrodes: np.ndarray, n: int) -> np.ndarray:
    """Return the noise (19,) of electrodes (T, 19) counts, rms, by steps over `APART` frames in calm windows of n."""
    starts = np.linspace(0, len(electrodes) - n, min(LOOKED_AT, len(electrodes) // n)).astype(int)
    windows = (electrodes[start : start + n].astype(float) for start in starts)
    steps = np.array([np.square(each[APART:] - each[:-APART]).mean(axis=0) for each in windows])
    return np.clip(np.sqrt(np.quantile(steps, CALMER, axis=0) / 2), NOISE, NOISIEST)


def _running(electrodes: np.ndarray, pdc: np.ndarray | None, n: int, rate: float) -> _Windows:
    """Return the statistics of all windows of n frames. A window is calm if for every electrode its standard deviation
    is at most `CALM_STD`, and the difference of its halves' means at most `CALM_TREND`, times the noise.
    electrodes : (T, 19) counts; pdc : (T,) counts, or None; rate : Hz"""
    half = max(1, n // 2)
    count = len(electrodes) - n + 1
    medians = np.array([[np.median(column)] for column in electrodes.T])
    noise = _noise(electrodes, n)[:, None]
    sums, calm = np.zeros((electrodes.shape[1], count)), np.ones(count, bool)
    for start in range(0, count, BLOCK):  # sums of all would take seven times the recording
        part = electrodes[start : start + BLOCK + n - 1].T.astype(float, order="C")
        exact = _sums(part, n)
        windows = slice(start, start + exact.shape[1])
        halves = _sums(part, half) / half
        trend = halves[:, n - half : n - half + exact.shape[1]] - halves[:, : exact.shape[1]]
        still = (_spread(part - medians, n) <= CALM_STD * noise) & (np.abs(trend) <= CALM_TREND * noise)
        calm[windows] = still.all(axis=0)
        sums[:, windows] = exact
    pressure = _sums(pdc, n) / n if pdc is not None else None
    return _Windows(n, sums, calm, pressure, (np.arange(count) + 0.5 * (n - 1)) / rate)


def _rest_rectified(windows: _Windows) -> np.ndarray:
    """Return (W,) bool, true for windows at rest in rectified readings: they are calm, and near zero, which is rest."""
    largest = windows.largest(lambda mean: mean)
    if windows.pdc is None:
        return windows.calm & (largest <= RECTIFIED_LEVEL)
    return windows.calm & (windows.pdc < QUIET_PDC) & (largest <= RECTIFIED_LEVEL_PDC)


def _rest_signed(windows: _Windows, kind: str, duration: float) -> np.ndarray:
    """Return (W,) bool, true for windows at rest: one calm window, and all calm windows that agree with its levels.
    kind : "raw", "tared" or "scaled"; duration : s, of the recording"""
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
    agree = possible & (off <= LEVEL + LEVEL_RATE * apart)
    if windows.pdc is None:
        return agree & _tracked(windows.sums, windows.n, windows.middle, agree, anchor, LEVEL, LEVEL_RATE)
    agree &= windows.pdc - windows.pdc[anchor] < QUIET_PDC + PDC_RATE * apart
    agree &= _tracked(windows.sums, windows.n, windows.middle, agree, anchor, LEVEL, LEVEL_RATE)
    return agree & _tracked(windows.pdc[None], 1, windows.middle, agree, anchor, QUIET_PDC, PDC_RATE)


def _tracked(
    sums: np.ndarray, n: int, middle: np.ndarray, possible: np.ndarray, anchor: int, level: float, rate: float
) -> np.ndarray:
    """Return (W,) bool, true for windows whose means stay near a tracked level, since drift over an hour can exceed a
    press. The tracked level starts at the window ``anchor`` and follows the possible windows.
    sums : (C, W) of n values of each channel; middle : (W,) s, time of the windows; possible : (W,) bool
    level : counts by which means may be off; rate : counts/s, by which the tracked level may move"""
    accepted = np.ones(len(middle), bool)
    candidates = np.flatnonzero(possible)
    near = level + rate * TRACKED
    # The level stays among the means that it follows: where these lie together, none can be far from it.
    if np.abs(middle - middle[anchor]).max() <= TRACKED or max(np.ptp(row[candidates]) for row in sums) <= near * n:
        return accepted
    for way in (candidates[candidates >= anchor], candidates[candidates < anchor][::-1]):
        now, last = sums[:, anchor] / n, float(middle[anchor])
        for start in range(0, len(way), STRETCH):
            rows = way[start : start + STRETCH]
            means, times = sums[:, rows].T / n, middle[rows].tolist()
            all_near = np.abs(means - now).max() + rate * abs(times[-1] - last) <= near
            for k, mean, time in zip(rows, means, times, strict=True):
                step = rate * abs(time - last)
                accepted[k] = all_near or np.abs(mean - now).max() <= near + step
                if accepted[k]:
                    now, last = np.minimum(np.maximum(mean, now - step), now + step), time
    return accepted


def _anchor(windows: _Windows, calm: np.ndarray, kind: str, duration: float) -> int:
    """Return the index of the calm window that is taken for rest, among those of lowest PDC: the first near the
    recording's start, or the last near its end; for another kind than "raw" the window nearest to zero.
    calm : (n,) int, indices of the windows to choose from; duration : s, of the recording"""
    if windows.pdc is not None:
        low = windows.pdc[calm]
        calm = calm[low <= low.min() + QUIET_PDC]
    if kind != "raw":
        return int(calm[np.argmin(windows.largest(np.abs)[calm])])
    early = windows.middle[calm] <= NEAR_END + 0.5 * WINDOW
    late = windows.middle[calm] >= duration - NEAR_END - 0.5 * WINDOW
    if early.any():
        return int(calm[0])
    return int(calm[-1]) if late.any() else int(calm[0])


def tare_frames(asked: slice | str, count: int) -> slice:
    """Return the frames to take rest from, a slice without a step. asked : slice or "A:B"; count : number of frames
    Raises TactileError for frames that are not a range within these."""
    if isinstance(asked, slice):
        tare = asked
    else:
        ends = asked.split(":") if isinstance(asked, str) else []
        try:
            tare = slice(*(int(end) if end.strip() else None for end in ends))
        except (ValueError, TypeError):
            ends = []
        if len(ends) != 2:
            raise TactileError("option tare", repr(asked), "frames A:B, such as 0:50, or 'none'")
    first = 0 if tare.start is None else tare.start + (count if tare.start < 0 else 0)
    last = count if tare.stop is None else tare.stop + (count if tare.stop < 0 else 0)
    if tare.step not in (None, 1) or not 0 <= first < last <= count:
        found = asked if isinstance(asked, str) else f"{tare.start}:{tare.stop}"
        expected = f"A:B inside {count} frames, without a step"
        raise TactileError("option tare", f"frames {found}", expected, "Name frames without contact")
    return slice(first, last)
