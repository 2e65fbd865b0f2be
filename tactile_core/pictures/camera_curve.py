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


def bent(change: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Apply the camera's curve to a ``change`` (...) of linear light: return the change that the picture shows, and its
    derivative by ``change``. rest : (...) grey levels of the untouched gel, from which changes are counted

    Below the toe's begin the shown change is toe + fall (exp((change - toe) / fall) - 1); the shoulder is alike."""
    toe, fall, shoulder, rise = ends(rest)
    below, above = np.minimum(change - toe, 0), np.maximum(change - shoulder, 0)
    dark, bright = np.exp(below / fall), np.exp(-above / rise)
    return change - below - above + fall * (dark - 1) + rise * (1 - bright), dark * bright


def ends(rest: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return (toe, fall, shoulder, rise), (...) levels: changes from ``rest`` (...) at which toe and shoulder begin,
    and after each the most that a shown change goes beyond it."""
    rest = np.clip(rest, 0, LARGEST_LEVEL)
    toe, fall = np.float32(TOE - 1) * rest, np.maximum(np.float32(TOE - FLOOR) * rest, np.float32(LEAST))
    shoulder = np.maximum(np.float32(SHOULDER) - rest, np.float32(0))
    return toe, fall, shoulder, np.maximum(np.float32(LARGEST_LEVEL) - rest - shoulder, np.float32(LEAST))
