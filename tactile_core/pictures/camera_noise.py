"""The camera's noise: a grain of some pixels, not one of each pixel's own, for the camera compresses what it sends."""

from __future__ import annotations

import numpy as np

from ..sensors.calibration import Calibration
from ..sensors.camera import COLOURS

# px at 240 wide: on real pictures noise correlates by 0.68, 0.42, 0.21, 0.0 over 1 to 4 px, along and across; means
# over squares of 4 px by 0.75, 0.5, 0.25, 0.
GRAIN = 4


def camera_noise(unit: Calibration, random: np.random.Generator) -> np.ndarray:
    """Draw noise (H, W, 3) float32 levels as measured on the unit: white, averaged over squares of GRAIN px."""
    camera = unit.camera
    width = max(GRAIN * camera.width // 240, 1)
    white = random.standard_normal((camera.height + width, camera.width + width, len(COLOURS)), np.float32)
    total = white.cumsum(0, dtype=np.float64).cumsum(1)
    across = total[:, width:] - total[:, :-width]
    grain = (across[width:] - across[:-width]) / width
    return (grain * np.asarray(unit.noise)).astype(np.float32)
