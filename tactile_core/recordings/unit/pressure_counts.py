"""Detect the unit of measurement of raw PDC: 12-bit counts, the electrodes' unit, or one of pressure."""

from __future__ import annotations

import numpy as np

from ...sensors import COUNT_MAX
from ...sensors.descriptor import of_kind
from ...sensors.fluid_sensor import Fluid

PRESSURES = {"Pa": 1.0, "hPa": 100.0, "kPa": 1e3, "psi": 6894.757}  # Pa
# For pressures converted from counts: how well readings lie on steps of one count (1: all do), and steps they span.
ON_STEPS, FEWEST_STEPS = 0.8, 4.0  # assumed
AT_REST = 800.0, 3000.0  # counts between which untared PDC rests: 915 to 2,405 in three fingers (assumed: some room)
NOISE, LEAST_NOISE = 4.0, 0.2  # counts, limits of the neighbours' median difference; below, averaged (assumed)
MOST = 1.01 * COUNT_MAX


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
    return factor * pdc


def counts_a_unit(pdc: np.ndarray, unit: float, sensor: str) -> tuple[float, str]:
    """Return how many counts 1 in pdc (T,) means, 0 if unknown, and the name of its unit of pressure, "" for counts.
    unit : counts that 1 means in the file's electrodes"""
    known = pdc[np.isfinite(pdc)]
    values = np.unique(known)
    if not len(values):
        return unit, ""
    parts = np.append(values - np.rint(values), 0.0 if len(values) == 1 else [])  # of one value alone it has to be 0
    whole, within = np.ptp(parts) < 1e-6, np.percentile(known, 99) <= MOST
    of_electrodes = values[-1] > COUNT_MAX if unit < 1 else unit > 1 and whole and values[-1] > 0
    if of_electrodes and values[-1] <= MOST / unit:
        return unit, ""
    factors = {words: pascal / of_kind(sensor, Fluid).readout.pressure for words, pascal in PRESSURES.items()}
    gap = np.diff(values).min() if len(values) > 1 else 1.0
    if whole and within and gap * factors["Pa"] < 0.9:  # else Pa in whole numbers, a count apart
        return 1.0, ""
    for words, factor in factors.items():  # the finest first: the steps of others are multiples of its
        steps = abs(np.exp(2j * np.pi * factor * values).mean())
        if steps > ON_STEPS and factor * np.ptp(values) >= FEWEST_STEPS and factor * values[-1] <= MOST:
            return factor, words
    del factors["hPa"]  # averaged counts rest there, too
    noise = np.median(np.abs(np.diff(known, prepend=known[0])))
    low, high = np.percentile(known, 5), max(values[-1], noise * MOST / NOISE)
    for words, factor in factors.items():  # rounded, or at rest throughout: by its level, if it has a count's noise
        averaged = 0 < factor * noise < LEAST_NOISE
        if AT_REST[0] <= factor * low <= AT_REST[1] and factor * high <= MOST and not averaged:
            return factor, words
    return float(within), ""
