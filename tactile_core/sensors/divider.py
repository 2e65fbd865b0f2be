"""Convert between an electrode's impedance and counts, and between the changes of units with different rest counts.

Each electrode forms a voltage divider with a load, over which counts are read, so that they fall as its film thins
(SynTouch, BioTac SP manual): E = COUNT_MAX / (1 + Z / load). With the impedance grown by a factor g since rest that is
COUNT_MAX / (1 + (COUNT_MAX / E_rest - 1) g): neither load nor conductivity matters, only the counts at rest.
"""

from __future__ import annotations

import numpy as np

from . import COUNT_MAX, REST_COUNTS

_ENDS = 0.4, COUNT_MAX - 0.4  # counts, which round to the converter's ends: there nothing is known of the impedance
# Counts that an electrode may rest at; real ones rest at 3,010 to 3,670 (two units, PHAC). One that is dead or
# saturated rests elsewhere, and its noise would be blown up without end.
_RESTS = 500.0, 3900.0


def reading(growth: np.ndarray, rest: np.ndarray | float) -> np.ndarray:
    """Return the counts (..., 19), not rounded, after impedances grew by factors (..., 19) from rest counts (19,)."""
    return COUNT_MAX / (1 + (COUNT_MAX / np.asarray(rest, float) - 1) * growth)


def growth(counts: np.ndarray, rest: np.ndarray | float) -> np.ndarray:
    """Return the factors (..., 19) by which impedances grew from rest counts (19,): the inverse of ``reading``."""
    now, before = np.clip(counts, *_ENDS), np.clip(rest, *_ENDS)
    return (COUNT_MAX / now - 1) / (COUNT_MAX / before - 1)


def typical(change: np.ndarray, rest: np.ndarray, to: np.ndarray = REST_COUNTS) -> np.ndarray:
    """Convert changes (..., 19) counts of a unit at rest counts (..., 19) to those of one at counts ``to`` (19,).

    A unit at 3,500 counts responds to a contact with four fifths, one at 2,800 with seven fifths of the latter's
    change.
    """
    rest = np.clip(rest, *_RESTS)
    return reading(growth(rest + change, rest), to) - to


def of_unit(change: np.ndarray, rest: np.ndarray, of: np.ndarray = REST_COUNTS) -> np.ndarray:
    """Convert changes of a unit at counts ``of`` (19,) to one at rest counts (19,): the inverse of ``typical``."""
    rest = np.clip(rest, *_RESTS)
    return reading(growth(of + change, of), rest) - rest
