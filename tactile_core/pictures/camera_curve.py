"""The camera's toe and shoulder: it compresses deep shadows and bright flanks, and is linear in between.

In a linear model a shadow may take more light than the untouched gel shows. Photographs never fall below a share of the
picture at rest, and bright flanks approach white (docs/calibration.md)."""

from __future__ import annotations

import numpy as np

from ..sensors.calibration import LARGEST_LEVEL

# Shares of the picture at rest where the toe begins, and that always remain; level where the shoulder begins (at rest
# if that is brighter). Read off all 14 photographs of the unit that ships, five of them in no fit.
TOE, FLOOR, SHOULDER = 0.5, 0.2, 190.0
LEAST = 1.0  # level, least range of an end


def bent(change: np.ndarray, curve: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Apply the camera's curve to a ``change`` (...) of linear light: return the change that the picture shows, and its
    derivative by ``change``. curve : (4, ...), of the same pixels, from ``ends``

    Below the toe's begin the shown change is toe + fall (exp((change - toe) / fall) - 1); the shoulder is alike."""
    linear = change.reshape(-1)
    shown, slope = linear.copy(), np.ones_like(linear)
    toe, fall, shoulder, rise = curve.reshape(4, -1)
    for beyond, begin, reach in ((linear < toe, toe, fall), (linear > shoulder, shoulder, -rise)):
        places = np.flatnonzero(beyond)  # few: the exponential takes longest
        begin, reach = begin[places], reach[places]
        slope[places] = np.exp((linear[places] - begin) / reach)
        shown[places] = begin + reach * (slope[places] - 1)
    return shown.reshape(change.shape), slope.reshape(change.shape)


def ends(rest: np.ndarray) -> np.ndarray:
    """Return the curve (4, ...) of pixels whose untouched gel has ``rest`` (...) grey levels: changes at which the toe
    begins, after it the most that a shown change goes beyond, and the same two of the shoulder."""
    rest = np.clip(rest, 0, LARGEST_LEVEL)
    toe, fall = np.float32(TOE - 1) * rest, np.maximum(np.float32(TOE - FLOOR) * rest, np.float32(LEAST))
    shoulder = np.maximum(np.float32(SHOULDER) - rest, np.float32(0))
    return np.stack([toe, fall, shoulder, np.maximum(np.float32(LARGEST_LEVEL) - rest - shoulder, np.float32(LEAST))])
