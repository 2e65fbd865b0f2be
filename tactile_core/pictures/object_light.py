"""Light that comes through the coating from the object that touches it. Photographs show it even over the contact, in
an LED's light and shadow alike, since it scatters in the object (docs/calibration.md); it is proportional to each LED's
power."""

from __future__ import annotations

import numpy as np

from ..errors import TactileError
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


def checked_reflectance(given: np.ndarray, name: str) -> np.ndarray:
    """Return a map `given` (h, w) of reflectance, 0 black to 1 white or grey levels of 8 bits, as float32 0..1. Raises
    TactileError, with ``name``, for another."""
    try:
        values = np.asarray(given)
    except ValueError:  # rows of unequal length
        values = np.asarray(given, object)
    if values.ndim != 2 or min(values.shape) < 2 or values.dtype.kind not in "buif":
        advice = "Average the three colours of a picture" if values.ndim == 3 else ""
        raise TactileError(name, f"{values.dtype} of shape {values.shape}", "grey (h, w), 2 x 2 or more", advice)
    white = 255 if values.dtype == np.uint8 else 1
    if not (values.min() >= 0 and values.max() <= white):
        found = f"values from {values.min():g} to {values.max():g}"
        raise TactileError(name, found, "0 black to 1 white, or uint8", "Divide by the level of white")
    return values.astype(np.float32) / np.float32(white)
