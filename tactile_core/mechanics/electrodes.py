"""The electrode forward model: raw counts from the thickness of the fluid film over each electrode."""

from __future__ import annotations

import numpy as np

from .. import sensors
from .compliance import Compliance, electrode_feet
from .contact import Contact, watched_gaps

FILM_FLOOR = 20e-6  # m, thinnest film the law knows (networks.md: s = 1 / max(gap, 0.02 mm))
# counts m: assumed. No gap law is published (mechanics.md); this one puts the 95th percentile of the largest change a
# press makes near 150 counts, the size that networks.md works with.
FILM_CONSTANT = 0.1


def electrode_gaps(compliance: Compliance, contact: Contact) -> np.ndarray:
    """Film thickness (19,) m over each electrode in a contact; negative where the linear model has run out."""
    return watched_gaps(compliance, contact)[: len(electrode_feet().gap)]


def signal_of_gaps(gaps: np.ndarray) -> np.ndarray:
    """Noise-free change (..., 19) of the raw counts against rest for film thicknesses (..., 19) m.

    b (1 / max(gap, floor) - 1 / gap at rest), the sign as in ``sensors.COUNT_SIGN`` (assumed).
    """
    rest = electrode_feet().gap
    return sensors.COUNT_SIGN * FILM_CONSTANT * (1 / np.maximum(gaps, FILM_FLOOR) - 1 / rest)


def raw_counts(change: np.ndarray, rest: np.ndarray, noise: float, drift: np.ndarray, seed: int) -> np.ndarray:
    """What the 12-bit converter delivers, (T, 19) int16, for changes (T, 19) counts.

    rest : (19,) counts without contact; noise : counts, standard deviation; drift : (19,) counts from first to last
    frame; seed : of the noise. Clipped to 0..4095 and rounded, as a converter does.
    """
    time = np.linspace(0, 1, len(change))[:, None]
    random = np.random.default_rng(seed)
    counts = rest + change + time * drift + noise * random.standard_normal(change.shape)
    return np.clip(np.round(counts), 0, sensors.COUNT_MAX).astype(np.int16)
