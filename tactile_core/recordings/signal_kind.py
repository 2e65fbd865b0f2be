"""Detect how counts were processed before they were written: raw, tared, tared and scaled, or rectified; and the unit
of measurement of raw electrodes and PDC."""

from __future__ import annotations

import numpy as np

from ..sensors import COUNT_MAX
from ..sensors.descriptor import of_kind
from ..sensors.fluid_sensor import Fluid

KINDS = ("raw", "tared", "scaled", "rectified")
RAW_LEVEL = 500.0  # counts; rest is near 3,300 (slide set) or 2,600-2,700 (Ruppel), changes stay below (assumed)
# Larger values than this are counts; scaled ones are volts, shares or standard deviations (assumed).
SCALED_LIMIT = 20.0
NEGATIVE_SHARE = 0.005  # of all samples: more than the odd glitch
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
OF_ELECTRODES = "in the electrodes' unit"
PRESSURES = {"Pa": 1.0, "hPa": 100.0, "kPa": 1e3, "psi": 6894.757}  # Pa
# For pressures converted from counts: how well readings lie on steps of one count (1: all do), and steps they span.
ON_STEPS, FEWEST_STEPS = 0.8, 4.0  # assumed
PDC_AT_REST = 800.0, 3000.0  # counts between which untared PDC rests: 915 to 2,405 in three fingers (assumed)
PDC_NOISE, LEAST_PDC_NOISE = 4.0, 0.2  # counts, limits of the neighbours' median difference; below, averaged (assumed)
MOST_PDC = 1.01 * COUNT_MAX


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
    levels = np.array([np.median(column) for column in electrodes.T])  # a column at a time: memory
    low, high = np.percentile(electrodes, [0.5, 99.5])
    whole = sum(int((np.abs(column - np.rint(column)) < 1e-9).sum()) for column in electrodes.T) / electrodes.size
    negative = float(np.mean(electrodes < 0))
    numbers = "whole numbers" if whole > WHOLE_SHARE else f"{1 - whole:.0%} fractions"
    span = f"{numbers} from {low:.4g} to {high:.4g}"
    if np.sum(levels > RAW_LEVEL) > len(levels) // 2:
        rests = f"medians of the electrodes {levels.min():.0f} to {levels.max():.0f} counts"
        return "raw", f"{span}; {rests}, far above any change"
    if whole <= WHOLE_SHARE and max(abs(low), abs(high)) <= SCALED_LIMIT:
        return "scaled", f"{span}, too small for counts"
    if negative > NEGATIVE_SHARE:
        return "tared", f"{span}; {negative:.0%} of the samples are negative"
    return "rectified", f"{span}: changes without a sign (tared ones have both, raw counts lie in the thousands)"


def in_counts(pdc: np.ndarray, unit: float, sensor: str, warnings: list[str]) -> np.ndarray | None:
    """Return pdc (T,), as a file has it, in counts; None if its unit of measurement cannot be found.
    unit : counts that 1 means in the file's electrodes; warnings : list, extended by what was assumed"""
    if not pdc.any():
        warnings.append("PDC is 0 in all frames: taken as not recorded")
        return None
    factor, words = counts_a_unit(pdc, unit, sensor)
    if not factor:
        warnings.append("PDC goes beyond 12 bit, and is no pressure in Pa, hPa, kPa or psi: taken as not recorded")
        return None
    if words:
        warnings.append(f"PDC is taken as {words}: {factor:.4g} counts a unit")
    counts = factor * pdc
    told = counts[np.isfinite(counts) & (counts != 0)]
    if 0 < len(told) < np.isfinite(counts).sum() and np.percentile(told, 1) >= PDC_AT_REST[0]:  # untared, as no 0 is
        warnings.append("PDC is 0 in some frames beside absolute pressures: taken as not recorded there")
        counts = np.where(counts == 0, np.nan, counts)
    return counts


def counts_a_unit(pdc: np.ndarray, unit: float, sensor: str) -> tuple[float, str]:
    """Return how many counts 1 in pdc (T,) means, 0 if unknown, and the name of its unit, "" for counts of any bits.
    unit : counts that 1 means in the file's electrodes"""
    known = pdc[np.isfinite(pdc)]
    values = np.unique(known)
    if not len(values):
        return unit, ""
    parts = np.append(values - np.rint(values), 0.0 if len(values) == 1 else [])  # of one value alone it has to be 0
    whole, within = np.ptp(parts) < 1e-6, np.percentile(known, 99) <= MOST_PDC
    percent = COUNT_MAX / 100.0  # seldom whole, then told by their level; shares and volts never are
    rests = unit == percent and PDC_AT_REST[0] <= unit * np.percentile(known, 5) <= PDC_AT_REST[1]
    fewer_bits = 1 < unit < percent or rests
    of_electrodes = values[-1] > COUNT_MAX if unit < 1 else fewer_bits and whole and values[-1] > 0
    if of_electrodes and values[-1] <= MOST_PDC / unit:
        return unit, ""
    factors = {words: pascal / of_kind(sensor, Fluid).readout.pressure for words, pascal in PRESSURES.items()}
    if unit > 1:
        factors = {OF_ELECTRODES: unit, **factors}
    gap = np.diff(values).min() if len(values) > 1 else 1.0
    if whole and within and gap * factors["Pa"] < 0.9:  # else Pa in whole numbers, a count apart
        return 1.0, ""
    for words, factor in factors.items():  # of pressures the finest first: steps of others are multiples of its
        steps = abs(np.exp(2j * np.pi * factor * values).mean())
        if steps > ON_STEPS and factor * np.ptp(values) >= FEWEST_STEPS and factor * values[-1] <= MOST_PDC:
            return factor, words
    del factors["hPa"]  # averaged counts rest there, too
    noise = np.median(np.abs(np.diff(known, prepend=known[0])))
    low, high = np.percentile(known, 5), max(values[-1], noise * MOST_PDC / PDC_NOISE)
    for words, factor in factors.items():  # rounded, or at rest throughout: by its level, if it has a count's noise
        averaged = 0 < factor * noise < LEAST_PDC_NOISE
        if PDC_AT_REST[0] <= factor * low <= PDC_AT_REST[1] and factor * high <= MOST_PDC and not averaged:
            return factor, words
    return float(within), ""
