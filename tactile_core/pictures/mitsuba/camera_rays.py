"""The camera's rays: a pinhole in air that looks through one flat window into gel and acrylic.

A calibrated camera says where on the plane of height zero each pixel looks, and where its pinhole appears in the
picture's middle. Rays that lean bend more, so that pixels farther out see the pinhole at another height: gel above that
plane shifts a little. What the window reflects, and its losses, are part of the calibrated lights and response.
"""

from __future__ import annotations

import numpy as np

from ...sensors.calibration import Calibration
from .window import air_over_window, tangent, window_height

_SINES = np.linspace(0, 0.999, 2000)  # of rays in air, for the table that inverts Snell's law


def camera_rays(unit: Calibration, right: np.ndarray, down: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return starts and directions (3, n) float32 of rays, right, up, toward the camera, mm, looking at places (n,) m.

    right, down : on the plane of height zero. Rays start under the window. A camera too near for its window to fit in
    has none.
    """
    camera, index = unit.camera, unit.gel_index
    air, window = air_over_window(camera, index), window_height(camera)
    if air <= 0:
        start = np.zeros((3, len(right)))
        start[2] = camera.apparent_height
    else:
        in_air, in_gel = tangent(_SINES), tangent(_SINES / index)
        distance = np.hypot(right, down)
        at_window = np.interp(distance, air * in_air + window * in_gel, air * in_air)
        share = np.divide(at_window, distance, out=np.zeros_like(distance), where=distance > 0)
        start = np.stack([right * share, down * share, np.full_like(right, window)])
    toward = np.stack([right, down, np.zeros_like(right)]) - start
    toward /= np.sqrt(np.square(toward).sum(0))
    flip = np.array([[1.0], [-1.0], [1.0]])
    return (1e3 * flip * start).astype(np.float32), (flip * toward).astype(np.float32)
