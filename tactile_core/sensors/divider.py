"""Convert between an electrode's impedance and counts, and between the changes of units with different rest counts.

Each electrode forms a voltage divider with a load across which counts are read, so that they fall as its film thins
(SynTouch, BioTac SP manual): E = COUNT_MAX / (1 + Z / load). If the impedance Z grows by a factor g from rest, E =
COUNT_MAX / (1 + (COUNT_MAX / E_rest - 1) g): neither load nor conductivity matters, only the counts at rest. Only the
film's part of Z grows as the film thins; the contact resistance in series stays, equal for all units.
"""

from __future__ import annotations

import numpy as np

from . import COUNT_MAX, REST_COUNTS, SOURCE
from .descriptor import of_kind
from .fluid_sensor import Fluid

# Resistance of an electrode's contact with the fluid, in series with the film, over the load.
_SERIES = of_kind(SOURCE, Fluid).fluid.interface / of_kind(SOURCE, Fluid).readout.load
_LEAST_LEFT = 0.05  # least share of a film that remains: the laws hold for no thinner one (assumed)
_ENDS = 0.4, COUNT_MAX - 0.4  # counts that round to the converter's ends, where the impedance is unknown
# Counts at rest that are converted; real ones are 3,010 to 3,670 (two units, PHAC). The noise of a dead or saturated
# electrode, which rests elsewhere, would be amplified without limit.
RESTS = 500.0, 3750.0


def reading(growth: np.ndarray | float, rest: np.ndarray | float) -> np.ndarray:
    """Return counts (..., 19), not rounded, at growth (..., 19) times the impedance that reads rest (19,) counts."""
    return COUNT_MAX / (1 + (COUNT_MAX / np.asarray(rest, float) - 1) * growth)


def of_films(growth: np.ndarray | float, rest: np.ndarray | float) -> np.ndarray:
    """Return the counts (..., 19), not rounded, if the films' impedances are ``growth`` (..., 19) times those at
    ``rest`` (19,) counts; the contacts' resistances stay."""
    return COUNT_MAX / (1 + np.maximum(_SERIES + _film(rest) * growth, 0))


def typical(change: np.ndarray, rest: np.ndarray, to: np.ndarray = REST_COUNTS) -> np.ndarray:
    """Convert change (..., 19) counts of a unit that rests at rest (..., 19) counts to that of one that rests at ``to``
    (19,); the films' impedances grow alike. A unit at 3,500 counts responds with 0.7 times the change of one at 3,300,
    a unit at 2,800 with 1.5 times."""
    rest, to = np.clip(rest, *RESTS), np.clip(to, *RESTS)
    return of_films(_film(rest + change) / _film(rest), to) - to


def of_unit(change: np.ndarray, rest: np.ndarray, of: np.ndarray = REST_COUNTS) -> np.ndarray:
    """Convert change (..., 19) counts of a unit that rests at ``of`` (19,) counts to that of a unit at ``rest`` (19,):
    the inverse of ``typical``."""
    return typical(change, of, rest)


def _film(counts: np.ndarray | float) -> np.ndarray:
    """Return the film's impedance (...) at counts (...), over the load's; below 0 for more counts than any film
    gives."""
    return COUNT_MAX / np.clip(counts, *_ENDS) - 1 - _SERIES


def film_impedance(counts: np.ndarray) -> np.ndarray:
    """Return the impedance (..., 19) of the film over each electrode at counts (..., 19), divided by the load's."""
    return np.maximum(_film(counts), 1e-3)


def of_typical_film(
    change: np.ndarray, rest: np.ndarray, thickness: float, conductivity: np.ndarray | float = 1.0
) -> np.ndarray:
    """Convert change (..., 19) counts of a unit at rest (..., 19) counts to that of a unit with typical films.

    thickness : of this unit's films at rest, over a typical unit's; conductivity : its fluid's, over that at rest
    If the skin moves by u over a film h, the impedance grows by g = h / (h - u); over a typical film of h / thickness
    the same u makes it grow by 1 / (1 - thickness (1 - 1 / g)), for each electrode by itself. Compared with the
    conducting sheet (111 simulated contacts), 7, 9, 12 and 14 % of the change remain as error at .8, .6, .45 and .33,
    and 28, 72, 136 and 246 % without the conversion."""
    rest = np.clip(rest, *RESTS)
    still = film_impedance(rest)
    thinned = 1 - still / (film_impedance(rest + change) * conductivity)
    left = np.maximum(1 - thickness * thinned, _LEAST_LEFT)
    return COUNT_MAX / (1 + _SERIES + still / left) - rest
