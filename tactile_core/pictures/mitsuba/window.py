"""The window that the camera looks through: gel and acrylic, which refract.

A calibrated camera says where on the plane of height zero each pixel looks, and where its pinhole appears in the
picture's middle. Rays from air into acrylic bend the more, the more they lean, so that pixels farther out see the
pinhole at another height: gel above that plane shifts a little. What the window reflects, and its losses, are part of
the calibrated lights and gain.
"""

from __future__ import annotations

import numpy as np

from ...sensors.camera import HEIGHT_ZERO_Y, Camera
from ...sensors.digit import BACK_Y

GEL_INDEX = 1.41  # assumed: of clear silicone rubbers
ACRYLIC_INDEX = 1.49  # of PMMA
ACRYLIC = 3e-3  # m, thickness: assumed
_GEL = BACK_Y - HEIGHT_ZERO_Y  # m of gel over the plane of height zero


def apparent_height(distance: np.ndarray, camera: Camera) -> np.ndarray:
    """Where the pinhole appears, m above height zero, to pixels that look at that plane a distance, m, off its axis.

    Snell's law through flat layers of gel, acrylic and air; the air is as thick as makes the answer on the axis the
    camera's own. A camera too near for its window to fit in keeps its height.
    """
    air = (camera.apparent_height - _GEL - ACRYLIC * GEL_INDEX / ACRYLIC_INDEX) / GEL_INDEX
    if air <= 0:
        return np.full(np.shape(distance), camera.apparent_height)
    sine = np.linspace(0, 0.999, 2000)  # of the ray in air
    in_gel, in_acrylic = (_tangent(sine / index) for index in (GEL_INDEX, ACRYLIC_INDEX))
    reach = air * _tangent(sine) + ACRYLIC * in_acrylic + _GEL * in_gel
    slope = np.interp(distance, reach, in_gel)
    return np.where(slope > 0, distance / np.where(slope > 0, slope, 1), camera.apparent_height)


def _tangent(sine: np.ndarray) -> np.ndarray:
    return sine / np.sqrt(1 - sine**2)


def through_window(picture: np.ndarray, height: np.ndarray, camera: Camera) -> np.ndarray:
    """The picture (H, W, k) of a pinhole as it looks through the window, float32.

    height : (H, W) m of the gel that each pixel of the picture sees
    """
    right, down = np.meshgrid(camera.right, camera.down)
    nearer = 1 - height / apparent_height(np.hypot(right, down), camera)
    # The same gel point, where the pinhole's picture shows it: off by a third of a pixel at most, so the height holds.
    scale = nearer / (1 - height / camera.apparent_height)
    column = right * scale / camera.pixel_size[0] + camera.width / 2 - 0.5
    row = down * scale / camera.pixel_size[1] + camera.height / 2 - 0.5
    return cubic(picture, row, column)


def cubic(picture: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Catmull-Rom interpolation of (h, w, k) at fractional places, edges held; exact at whole ones."""
    i, j = np.floor(row).astype(int), np.floor(column).astype(int)
    weights_row, weights_column = _catmull_rom(row - i), _catmull_rom(column - j)
    found = np.zeros(row.shape + picture.shape[2:])
    for a in range(4):
        at_row = np.clip(i + a - 1, 0, picture.shape[0] - 1)
        for b in range(4):
            at_column = np.clip(j + b - 1, 0, picture.shape[1] - 1)
            found += (weights_row[a] * weights_column[b])[..., None] * picture[at_row, at_column]
    return found.astype(np.float32)


def _catmull_rom(t: np.ndarray) -> list[np.ndarray]:
    return [
        0.5 * (-t + 2 * t**2 - t**3),
        0.5 * (2 - 5 * t**2 + 3 * t**3),
        0.5 * (t + 4 * t**2 - 3 * t**3),
        0.5 * (t**3 - t**2),
    ]
