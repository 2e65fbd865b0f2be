"""Tell whether a level that was taken for rest looks like a contact: a steady grip is as calm as an untouched finger.

Units rest at different counts, but of five real ones a contact explains little of how: beside a conductivity of its own
it leaves .53 to .84. Of eight hard grips it leaves .23 to .38; soft ones (.47 to .87) are not told apart.
"""

from __future__ import annotations

import numpy as np

from ...sensors import contacts_of, divider, typical_rest
from ..polarity import contact_signals

CONDUCTIVITIES = np.linspace(-1.5, 1.5, 151)  # logarithms of impedances over a typical unit's, that are tried
MOST_LEFT = 0.45  # of what a conductivity leaves: between units at rest and hard grips, see above
LEAST = 100.0  # counts, root of the sum of squares: units differ by 106 to 434 beside their conductivity


def as_contact(level: np.ndarray, sensor: str) -> float | None:
    """Return the share (0..1) of how a level differs from a typical unit at rest that one contact explains.

    None where that is too little for a contact, and for a sensor without simulated contacts. The unit's conductivity is
    free. level : (e,) counts
    """
    typical = typical_rest(sensor)
    if typical is None or contacts_of(sensor) is None:
        return None
    rest = divider.of_films(np.exp(CONDUCTIVITIES)[:, None], typical)
    change = divider.typical(level - rest, rest, typical)
    known = contact_signals(sensor)
    onto = (change @ (known / np.linalg.norm(known, axis=1, keepdims=True)).T).max(axis=1)
    squares = np.square(change).sum(axis=1)
    alone = np.sqrt(squares.min())
    left = np.sqrt(np.maximum(squares - np.square(np.maximum(onto, 0)), 0).min())
    return 1 - float(left / alone) if alone > LEAST and left < MOST_LEFT * alone else None
