"""Convert a file's time stamps to seconds: find their unit and rate, and missing, coarse or disordered stamps."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..sensors import SAMPLE_RATE

Unit = Literal["s", "ms", "us", "ns"]
SECONDS: dict[Unit, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
WORDS: dict[Unit, str] = {"ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
UNIX: dict[Unit, float] = {"ns": 1e17, "us": 1e14, "ms": 1e11}  # least stamp of unix time in that unit: of 1973
SINCE_1970 = 1e8  # s; below: seconds since something else
LIKELY = 25.0, 500.0  # Hz; a BioTac's drivers give 100 frames per second, some loggers fewer or twice as many (assumed)
SHARED = 0.5  # of the frames that have the stamp of the one before: the clock is coarser than the frames (assumed)
FEWEST = 20  # frames by which a clock is called coarse (assumed)
GAP_STEPS = 1.9  # a missing frame is 2 median steps; jitter of whole recordings reaches 1.8 (18 ms: docs/sources.md)
OTHER_RATE = 1.6  # times the usual rate, or a share of it, from which on it is said; 62.5 to 160 Hz are fine (assumed)
MAX_STAMP = 1e19  # the year 2286 in nanoseconds


def seconds_of(stamps: np.ndarray) -> tuple[np.ndarray, float, list[str]]:
    """Return time (T,) s from the first frame, its unix time, s (0: unknown), warnings; stamps : (T,) s to ns"""
    stamps = np.where(np.abs(stamps) <= MAX_STAMP, stamps, np.nan)
    warnings, missing = [], int(np.isnan(stamps).sum())
    if missing == len(stamps):
        warnings.append(f"none of {missing} time stamps is a time; {SAMPLE_RATE:g} Hz assumed")
    elif missing:
        warnings.append(f"{missing} of {len(stamps)} time stamps are no times; filled from those around them")
    stamps = _fill_stamps(stamps)
    unit = unit_of(stamps)
    if unit != "s":
        stamps = stamps * SECONDS[unit]
        warnings.append(f"time stamps taken as {WORDS[unit]}{' of unix time' if stamps[0] > SINCE_1970 else ''}")
    start = float(stamps[0]) if stamps[0] > SINCE_1970 else 0.0
    seconds, coarse = _spread(stamps - stamps[0])
    return seconds, start, [*warnings, *coarse]


def unit_of(stamps: np.ndarray) -> Unit:
    """Return the unit of time stamps (T,), such as "ms": one that gives a likely rate, else one that fits unix time."""
    steps = np.diff(stamps)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    likely = [unit for unit, length in SECONDS.items() if LIKELY[0] <= 1 / max(step * length, 1e-12) <= LIKELY[1]]
    if likely:
        return likely[0]
    size = np.median(np.abs(stamps))
    return next((unit for unit, least in UNIX.items() if size > least), "s")


def is_likely(values: np.ndarray) -> bool:
    """Return true if a column's values (T,) may be time stamps, in any unit: they never fall, at a sensor's rate."""
    steps = np.diff(values)
    if not len(steps) or not (steps >= 0).all() or not (steps > 0).any():
        return False
    lengths = [np.median(steps[steps > 0])]
    if (values != np.rint(values)).any():  # a coarse clock, and no numbers of rows or blocks
        lengths.append(steps.mean())
    rates = [1 / (length * unit) for length in lengths for unit in SECONDS.values()]
    return any(LIKELY[0] <= rate <= LIKELY[1] for rate in rates)


def _spread(seconds: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Return seconds (T,), frames that share a stamp spread evenly up to the next one, and sentences on it."""
    steps = np.diff(seconds)
    if len(steps) < FEWEST or not (steps >= 0).all() or (steps == 0).mean() < SHARED:
        return seconds, []
    first = np.r_[0, np.flatnonzero(steps > 0) + 1]
    if len(first) < 3:
        return np.arange(len(seconds)) / SAMPLE_RATE, [f"time stamps stand still; {SAMPLE_RATE:g} Hz assumed"]
    frames = np.arange(len(seconds))
    step = float(np.median(np.diff(seconds[first[1:]]) / np.diff(first[1:])))
    spread = np.interp(frames, first[1:], seconds[first[1:]])
    spread[: first[1]] = seconds[first[1]] - step * (first[1] - frames[: first[1]])
    spread[first[-1] :] = seconds[first[-1]] + step * (frames[first[-1] :] - first[-1])
    apart = float(np.median(steps[steps > 0]))
    sentence = f"time stamps {apart:.3g} s apart, each of about {apart / step:.0f} frames: spread evenly between them"
    return spread - spread[0], [sentence]


def tell_rate(seconds: np.ndarray) -> list[str]:
    """Return a list of one sentence if frames at seconds (T,) come at another rate than filters expect, else []."""
    steps = np.diff(seconds)
    forward = steps[steps > 0]
    if not len(forward):
        return []
    rate = 1.0 / float(np.median(forward))
    if SAMPLE_RATE / OTHER_RATE <= rate <= SAMPLE_RATE * OTHER_RATE:
        return []
    return [
        f"{rate:.4g} frames a second, where {SAMPLE_RATE:g} are expected (if the stamps are not seconds, a map says so:"
        " tactile info FILE --columns map.toml): what looks at the frames before and after"
        f" (glitches, smoothing, following a contact) sees another time; resample to {SAMPLE_RATE:g} Hz to be sure"
    ]


def _fill_stamps(stamps: np.ndarray) -> np.ndarray:
    """Return stamps (T,) with NaN interpolated; at the ends extrapolated by the median step."""
    good = np.flatnonzero(np.isfinite(stamps))
    if len(good) == len(stamps):
        return stamps
    if len(good) == 0:
        return np.arange(len(stamps)) / SAMPLE_RATE
    index = np.arange(len(stamps))
    filled = np.interp(index, good, stamps[good])
    step = float(np.median(np.diff(stamps[good]) / np.diff(good))) if len(good) > 1 else 1.0 / SAMPLE_RATE
    filled[: good[0]] = stamps[good[0]] + (index[: good[0]] - good[0]) * step
    filled[good[-1] + 1 :] = stamps[good[-1]] + (index[good[-1] + 1 :] - good[-1]) * step
    return filled


def time_jumps(seconds: np.ndarray, rows: np.ndarray, row_word: str) -> tuple[np.ndarray, list[str]]:
    """Return the indices (n,) of frames before which seconds (T,) go back, stand still or leave a gap, and sentences on
    these. rows : (T,) int, the frames' rows in the file, which the sentences call row_word"""
    steps = np.diff(seconds)
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if len(forward) else 1.0 / SAMPLE_RATE
    backward, gap = steps <= 0, steps > GAP_STEPS * usual
    sentences = []
    for what, where in (("do not go forward", backward), ("leave a gap", gap)):
        frames = np.flatnonzero(where) + 1
        if len(frames):
            first = frames[0]
            worst = frames[np.argmax(np.abs(steps[frames - 1]))]
            sentences.append(
                f"time stamps {what} at {len(frames)} place{'s' * (len(frames) > 1)}, first before {row_word}"
                f" {rows[first]} ({1e3 * steps[first - 1]:.1f} ms), largest before {row_word} {rows[worst]}"
                f" ({1e3 * steps[worst - 1]:.1f} ms);"
                " frames stay in file order"
            )
    return np.flatnonzero(backward | gap) + 1, sentences
