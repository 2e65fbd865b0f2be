"""The camera's toe and shoulder: deep shadows and bright flanks keep a part of their light, and with it their hue.

By linear light a shadow would take more than the untouched gel shows there. Photographs never fall below a share of the
picture at rest, and bright flanks approach white; between both ends the camera is linear (docs/calibration.md)."""

from __future__ import annotations

import numpy as np

from ..sensors.calibration import LARGEST_LEVEL

# Read off all 14 photographs of the unit that ships, five of them in no fit: what is left of the picture at rest where
# the toe begins, and what never goes; the level where the shoulder begins (or at rest where the gel is brighter).
TOE, FLOOR, SHOULDER = 0.5, 0.2, 190.0
LEAST = 1.0  # level, over which an end bends at least


def bent(change: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the change (...), levels, that the camera shows for a change of linear light, and the slope between them.
    rest : (...) levels of the untouched gel, which are shown unchanged"""
    toe, fall, shoulder, rise = ends(rest)
    below, above = np.minimum(change - toe, 0), np.maximum(change - shoulder, 0)
    dark, bright = np.exp(below / fall), np.exp(-above / rise)
    return change - below - above + fall * (dark - 1) + rise * (1 - bright), dark * bright


def ends(rest: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return where toe and shoulder begin, as changes (...) levels from ``rest`` (...), each followed by its range."""
    rest = np.clip(rest, 0, LARGEST_LEVEL)
    toe, fall = np.float32(TOE - 1) * rest, np.maximum(np.float32(TOE - FLOOR) * rest, np.float32(LEAST))
    shoulder = np.maximum(np.float32(SHOULDER) - rest, np.float32(0))
    return toe, fall, shoulder, np.maximum(np.float32(LARGEST_LEVEL) - rest - shoulder, np.float32(LEAST))
