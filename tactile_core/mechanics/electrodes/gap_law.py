"""The electrode forward model: raw counts from the thickness of the fluid film over each electrode.

The cheap law, 1 / gap, beside that of the thin sheet (``law``).
"""

from __future__ import annotations

import numpy as np

from ... import sensors
from ..fast.sensing_points import electrode_feet

# counts m: assumed. No gap law is published (docs/sources.md); this one puts the 95th percentile of the largest change
# a press makes near 150 counts, as of the networks' prototype. One constant for all electrodes: against the thin
# sheet it leaves 9 counts rms of 20 over 240 contacts, a constant for each electrode 7
# (`scripts/benchmarks/mechanics/electrode_law.py` of commit d537259).
FILM_CONSTANT = 0.1


def signal_of_gaps(gaps: np.ndarray, sensor: str = "biotac") -> np.ndarray:
    """Noise-free change (..., e) of the raw counts against rest for film thicknesses (..., e) m.

    b (1 / max(gap, floor) - 1 / gap at rest), the sign as in ``sensors.COUNT_SIGN``.
    """
    rest = electrode_feet(sensor).gap
    return sensors.COUNT_SIGN * FILM_CONSTANT * (1 / np.maximum(gaps, film_floor(sensor)) - 1 / rest)


def film_floor(sensor: str) -> float:
    """Thickness, m, of the thinnest film of a sensor that the laws know."""
    return sensors.skin_of(sensor).descriptor.fluid.thinnest
