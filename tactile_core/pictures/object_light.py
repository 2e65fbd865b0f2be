"""Light that comes through the coating from the object that touches it. Photographs show it as even over the whole
contact, in an LED's light and in its shadow: it goes sideways in the object before it comes back (docs/calibration.md).
It goes with each LED's power."""

from __future__ import annotations

import numpy as np

from ..sensors.calibration import Calibration

FULL = 0.5  # of the largest rise, from which on all of it is seen; less in proportion (two photographs, see the page)
FLOOR = 5e-6  # m: gel that is dented less touches nothing, as in ``translation.gel_place``


def contact_share(risen: np.ndarray) -> np.ndarray:
    """Return the share (H, W) float32, 0..1, of an object's light that pixels show; risen : (H, W) m, over the rest."""
    deepest = float(risen.max())
    if deepest < FLOOR:
        return np.zeros_like(risen)
    share = risen * np.float32(1 / (FULL * deepest))
    return share.clip(0, 1, out=share)


def object_light(unit: Calibration, risen: np.ndarray) -> np.ndarray:
    """Return the radiance (3, H, W) float32, levels, of the object behind gel that has risen by (H, W) m."""
    levels = (unit.through * unit.facing).astype(np.float32)
    return levels[:, None, None] * contact_share(risen)
