"""Convert between a calibration's image frame and a gel object's own axes and units."""

from __future__ import annotations

import numpy as np

from ...tactile_core.sensors.camera import Camera
from . import axes


def to_gel(places: np.ndarray, camera: Camera, per_metre: float) -> np.ndarray:
    """Convert places (..., 3) m, image frame (right, down, camera), to the gel's axes, ``per_metre`` units a metre."""
    right, down, toward = np.moveaxis(np.asarray(places, float), -1, 0)
    x, z = camera.centre_x + camera.down_x * down, camera.centre_z + camera.right_z * right
    return axes.to_blender(np.stack([x, camera.height_zero_y + toward, z], -1), per_metre)


def from_gel(places: np.ndarray, camera: Camera, per_metre: float) -> np.ndarray:
    """Convert places (..., 3) in the gel object's axes and units, ``per_metre`` in a metre, to the image frame, float64
    m: the inverse of ``to_gel``."""
    x, y, z = np.moveaxis(axes.to_sensor(places, per_metre), -1, 0)
    right, down = camera.right_z * (z - camera.centre_z), camera.down_x * (x - camera.centre_x)
    return np.stack([right, down, y - camera.height_zero_y], -1)
