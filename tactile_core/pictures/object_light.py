"""Light that comes through the coating from the object that touches it. Photographs show it even over the contact, in
an LED's light and shadow alike, since it scatters in the object (docs/calibration.md); it is proportional to each LED's
power."""

from __future__ import annotations

import numpy as np

from ..sensors.calibration import Calibration

FULL = 0.5  # share of the largest rise that shows all of the light; less does in proportion (two photographs, see page)
FLOOR = 5e-6  # m, least rise of gel in contact, as in ``translation.gel_place``


def contact_share(risen: np.ndarray) -> np.ndarray:
    """Return the share (H, W) float32, 0..1, of an object's light in each pixel; risen : (H, W) m, over the rest"""
    deepest = float(risen.max())
    if deepest < FLOOR:
        return np.zeros_like(risen)
    share = risen * np.float32(1 / (FULL * deepest))
    return share.clip(0, 1, out=share)


def object_light(unit: Calibration, risen: np.ndarray, reflectance: np.ndarray | None = None) -> np.ndarray:
    """Return the radiance (3, H, W) float32, levels, of an object behind gel that has risen by ``risen`` (H, W) m.
    reflectance : (H, W) of the object at each pixel, 0 black to 1 white; None for the calibration's, everywhere"""
    amount, share = unit.through, contact_share(risen)
    if reflectance is not None:
        amount, share = unit.coating.transmission, share * reflectance
    return (amount * unit.facing).astype(np.float32)[:, None, None] * share
