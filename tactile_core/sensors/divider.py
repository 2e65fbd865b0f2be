"""Convert between an electrode's impedance and counts, and between the changes of units with different rest counts.

Each electrode forms a voltage divider with a load, over which counts are read, so that they fall as its film thins
(SynTouch, BioTac SP manual): E = COUNT_MAX / (1 + Z / load). With the impedance grown by a factor g since rest that is
COUNT_MAX / (1 + (COUNT_MAX / E_rest - 1) g): neither load nor conductivity matters, only the counts at rest.
"""

from __future__ import annotations

import numpy as np

from . import COUNT_MAX, REST_COUNTS, SOURCE
from .descriptor import of_kind
from .fluid_sensor import Fluid

# Of an electrode's impedance over the load, what its contact with the fluid resists: no part of the film's.
_SERIES = of_kind(SOURCE, Fluid).fluid.interface / of_kind(SOURCE, Fluid).readout.load
_LEAST_LEFT = 0.05  # of a film, share below which it is not thinned: the laws know none thinner (assumed)
_ENDS = 0.4, COUNT_MAX - 0.4  # counts, which round to the converter's ends: there nothing is known of the impedance
# Counts that an electrode may rest at; real ones rest at 3,010 to 3,670 (two units, PHAC). One that is dead or
# saturated rests elsewhere, and its noise would be blown up without end.
_RESTS = 500.0, 3900.0


def reading(growth: np.ndarray | float, rest: np.ndarray | float) -> np.ndarray:
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


def film_impedance(counts: np.ndarray) -> np.ndarray:
    """Return the impedance (..., 19) of the film over each electrode at counts (..., 19), over the load."""
    return np.maximum(COUNT_MAX / np.clip(counts, *_ENDS) - 1 - _SERIES, 1e-3)


def of_typical_film(
    change: np.ndarray, rest: np.ndarray, thickness: float, conductivity: np.ndarray | float = 1.0
) -> np.ndarray:
    """Convert changes (..., 19) counts of a unit at rest counts (..., 19) to those of one with typical films.

    thickness : of its films at rest, over a typical unit's; conductivity : its fluid's, over that at rest
    The same movement u of the skin over a film h makes the impedance grow by g = h / (h - u), so that over a typical
    film of h / thickness it grows by 1 / (1 - thickness (1 - 1 / g)): each electrode by itself. Against the conducting
    sheet (111 simulated contacts) 7, 9, 12 and 14 % of the change are left at .8, .6, .45 and .33, where 28, 72, 136
    and 246 % are without.
    """
    rest = np.clip(rest, *_RESTS)
    still = film_impedance(rest)
    thinned = 1 - still / (film_impedance(rest + change) * conductivity)
    left = np.maximum(1 - thickness * thinned, _LEAST_LEFT)
    return COUNT_MAX / (1 + _SERIES + still / left) - rest
