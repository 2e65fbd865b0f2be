"""Tell the unit of the fluid's pressure beside raw electrodes: counts of 12 bit, the electrodes' own, or a pressure."""

from __future__ import annotations

import numpy as np

from ...sensors import COUNT_MAX
from ...sensors.descriptor import of_kind
from ...sensors.fluid_sensor import Fluid

PRESSURES = {"Pa": 1.0, "hPa": 100.0, "kPa": 1e3, "psi": 6894.757}  # Pa
# Of the readings, counts that were converted: how well they lie on the steps of one (1 is all), and how many they span.
ON_STEPS, FEWEST_STEPS = 0.8, 4.0  # assumed
AT_REST = 800.0, 3000.0  # counts between which untared PDC rests: 915 to 2,405 in three units (assumed: some room)
NOISE = 4.0  # counts, half of all neighbours differ by less (assumed)
MOST = 1.01 * COUNT_MAX


def in_counts(pdc: np.ndarray, unit: float, sensor: str, warnings: list[str]) -> np.ndarray | None:
    """Return PDC (T,) of raw electrodes in counts; None where it is 0 throughout, or of no unit that is known.

    unit : counts a unit of the electrodes; what is found is added to the warnings
    """
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
    """Return the counts a unit of PDC (T,), 0 where it cannot be told, and its pressure's unit, "" where it is none.

    unit : counts a unit of the electrodes, which PDC shares where it has their range
    """
    known = pdc[np.isfinite(pdc)]
    values = np.unique(known)
    if not len(values) or (unit != 1 and (COUNT_MAX if unit < 1 else 0) < values[-1] <= MOST / unit):
        return unit, ""
    whole, within = np.ptp(values - np.rint(values)) < 1e-6, np.percentile(known, 99) <= MOST
    if whole and within:
        return 1.0, ""
    factors = {words: pascal / of_kind(sensor, Fluid).readout.pressure for words, pascal in PRESSURES.items()}
    for words, factor in factors.items():  # the finest first: the steps of others are multiples of its
        steps = abs(np.exp(2j * np.pi * factor * values).mean())
        if steps > ON_STEPS and factor * np.ptp(values) >= FEWEST_STEPS and factor * values[-1] <= MOST:
            return factor, words
    del factors["hPa"]  # averaged counts rest there, too
    noise = np.median(np.abs(np.diff(known, prepend=known[0])))
    for words, factor in factors.items():  # rounded, or at rest throughout: by its level
        if AT_REST[0] <= factor * values[0] <= AT_REST[1] and factor * max(values[-1], noise * MOST / NOISE) <= MOST:
            return factor, words
    return float(within), ""
