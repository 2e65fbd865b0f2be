"""The camera's toe and shoulder: deep shadows and bright flanks keep a part of their light, and with it their hue.

Linear light would take more from a shadow than the untouched gel shows there: photographs hold no level of 0 and few of
255, pictures of deep contacts some per cent. Between both ends the camera is linear (docs/calibration.md).
"""

from __future__ import annotations

import numpy as np

from ..sensors.calibration import LARGEST_LEVEL

TOE = 0.5  # of the picture at rest, below which light falls off as an exponential; chosen on 14 photographs, by thirds
SHOULDER = 210.0  # levels, or those at rest where they are more, above which it rises as one
ENDS = 1.0  # level, of a toe and a shoulder at least


def curved(levels: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Bend levels (H, W, 3) float32 of linear light in place, and return them; rest : the same of the untouched gel."""
    low = levels < np.float32(TOE) * rest
    toe = np.maximum(np.float32(TOE) * rest[low], np.float32(ENDS))
    levels[low] = toe * np.exp(levels[low] / toe - 1)
    high = levels > np.maximum(rest, np.float32(SHOULDER))
    room = np.maximum(LARGEST_LEVEL - np.maximum(rest[high], np.float32(SHOULDER)), np.float32(ENDS))
    bent = LARGEST_LEVEL - room * np.exp((LARGEST_LEVEL - levels[high]) / room - 1)
    levels[high] = np.where(levels[high] > LARGEST_LEVEL - room, bent, levels[high])
    return levels
