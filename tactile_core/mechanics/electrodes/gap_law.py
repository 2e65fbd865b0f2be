"""The electrode forward model: raw counts from the thickness of the fluid film over each electrode.

The cheap law, 1 / gap, beside that of the thin sheet (``law``); ``benchmarks.mechanics.electrode_law`` holds the one
against the other.
"""

from __future__ import annotations

import numpy as np

from ... import sensors
from ...sensors import biotac
from ..fast.sensing_points import electrode_feet

FILM_FLOOR = biotac.DESCRIPTOR.fluid.thinnest  # m, thinnest film the law knows
# counts m: assumed. No gap law is published (docs/sources.md); this one puts the 95th percentile of the largest change
# a press makes near 150 counts, as of the networks' prototype. One constant for all electrodes: against the thin
# sheet it leaves 9 counts rms of 20 over 240 contacts, a constant for each electrode 7 (``electrode_law``).
FILM_CONSTANT = 0.1


def signal_of_gaps(gaps: np.ndarray) -> np.ndarray:
    """Noise-free change (..., 19) of the raw counts against rest for film thicknesses (..., 19) m.

    b (1 / max(gap, floor) - 1 / gap at rest), the sign as in ``sensors.COUNT_SIGN``.
    """
    rest = electrode_feet().gap
    return sensors.COUNT_SIGN * FILM_CONSTANT * (1 / np.maximum(gaps, FILM_FLOOR) - 1 / rest)
