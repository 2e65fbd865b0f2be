"""Detect how counts were processed before they were written: raw, tared, tared and scaled, or rectified."""

from __future__ import annotations

import numpy as np

from ..sensors import COUNT_MAX

KINDS = ("raw", "tared", "scaled", "rectified")
RAW_LEVEL = 500.0  # counts; rest is near 3,300 (slide set) or 2,600-2,700 (Ruppel), changes stay below (assumed)
# Larger values than this are counts; scaled ones are volts, shares or standard deviations (assumed).
SCALED_LIMIT = 20.0
NEGATIVE_SHARE = 0.005  # of all samples: more than the odd glitch
WHOLE = np.arange(-(2**15), 2**15)  # the histogram's numbers
WHOLE_SHARE = 0.99  # of all samples: a file with more whole numbers holds counts (assumed)
# Top of the range of raw readings in other units of measurement than 12-bit counts (assumed: the usual exports).
FULL_SCALES = {
    1.0: "shares of the range", 3.3: "volts of 3.3 V", 5.0: "volts of 5 V", 100.0: "percent of the range",
    255.0: "counts of 8 bit", 1023.0: "counts of 10 bit", 65535.0: "counts of 16 bit",
}  # fmt: skip
AT_REST = 0.55, 0.97  # shares of the range between which a unit's electrodes rest in the median (2,600 to 3,500 counts)
BEYOND = 1.01  # times the range, that no reading exceeds but by noise (assumed)
LEAST_RAW = 0.3  # share of the range below which raw readings of an electrode do not fall (assumed)
MOST_OF = 2 / 3  # of the electrodes, that have to agree: some may be dead (assumed)


def counted(columns: np.ndarray) -> np.ndarray | None:
    """Return the histograms (e, 65536) int of columns (T, e) of whole numbers, from -32,768 on; None for other numbers
    and short columns. (They replace sorting, which takes long and twice the memory.)"""
    if len(columns) < len(WHOLE):
        return None
    counts = np.empty((columns.shape[1], len(WHOLE)), int)
    for j, column in enumerate(columns.T):
        whole = column.astype(np.int32)
        if (whole != column).any() or whole.min() < WHOLE[0] or whole.max() > WHOLE[-1]:
            return None
        counts[j] = np.bincount(whole - WHOLE[0], minlength=len(WHOLE))
    return counts


def percentiles(counts: np.ndarray, shares: list[float]) -> np.ndarray:
    """Return the percentiles, as numpy's, of whole numbers. counts : (65536,) their histogram; shares : per cent"""
    place = np.array(shares) / 100 * (counts.sum() - 1)
    below = np.floor(place)
    low, high = (WHOLE[np.searchsorted(np.cumsum(counts), rank, "right")] for rank in (below, np.ceil(place)))
    return low + (high - low) * (place - below)


def median(column: np.ndarray) -> float:
    """Return the median of a column (T,) of finite numbers."""
    counts = counted(column[:, None])
    return float(np.median(column)) if counts is None else float(percentiles(counts[0], [50])[0])


def full_scale(electrodes: np.ndarray) -> tuple[float, str] | None:
    """Return counts per unit of measurement, and that unit in words, if raw readings are in volts, shares of the range
    or counts of other bits; None for 12-bit counts and for readings that are not raw.
    electrodes : (T, e) float, finite; they are raw if most rest high in the range and stay far from 0"""
    past_10_bit, past_12_bit = (
        ((electrodes > BEYOND * full).mean(axis=0) > 0.5).mean() for full in (1023.0, COUNT_MAX)
    )
    if past_10_bit > 1 - MOST_OF and past_12_bit < MOST_OF:  # counts, seen without sorting them
        return None
    low, levels, high = np.transpose([np.percentile(column, [1, 50, 99]) for column in electrodes.T])
    for full, words in FULL_SCALES.items():
        within = (low >= LEAST_RAW * full) & (high <= BEYOND * full)
        if within.mean() >= MOST_OF and AT_REST[0] <= np.median(levels[within]) / full <= AT_REST[1]:
            return COUNT_MAX / full, words
    return None


def detect(electrodes: np.ndarray) -> tuple[str, str]:
    """Return the kind of electrodes (T, 19) float, finite, as in the file: "raw", "tared" (rest subtracted), "scaled"
    (tared, in another unit) or "rectified" (absolute changes); and what shows it, in words."""
    counts = counted(electrodes)
    if counts is not None:
        levels = np.array([percentiles(each, [50])[0] for each in counts])
        low, high = percentiles(counts.sum(axis=0), [0.5, 99.5])
        whole = 1.0
    else:  # a column at a time: memory
        levels = np.array([np.median(column) for column in electrodes.T])
        low, high = np.percentile(electrodes, [0.5, 99.5])
        whole = sum(int((np.abs(column - np.rint(column)) < 1e-9).sum()) for column in electrodes.T) / electrodes.size
    negative = float(np.mean(electrodes < 0))
    numbers = "whole numbers" if whole > WHOLE_SHARE else f"{1 - whole:.0%} fractions"
    span = f"{numbers} from {low:.4g} to {high:.4g}"
    if np.sum(levels > RAW_LEVEL) > len(levels) // 2:
        return (
            "raw",
            f"{span}; medians of the electrodes {levels.min():.0f} to {levels.max():.0f} counts, far above any change",
        )
    if whole <= WHOLE_SHARE and max(abs(low), abs(high)) <= SCALED_LIMIT:
        return "scaled", f"{span}, too small for counts"
    if negative > NEGATIVE_SHARE:
        return "tared", f"{span}; {negative:.0%} of the samples are negative"
    return "rectified", f"{span}: changes without a sign (tared ones have both, raw counts lie in the thousands)"
