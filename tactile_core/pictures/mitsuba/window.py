"""The window that the camera looks through: gel and acrylic, which refract as one medium.

A calibrated camera says where on the plane of height zero each pixel looks, and the pinhole's apparent position for the
picture's middle. Refraction from air into acrylic grows with the angle, so pixels farther out see the pinhole at
another height: gel above that plane shifts a little. Reflections and losses of the window are part of the calibrated
lights and response."""

from __future__ import annotations

import numpy as np

from ...geometry.cubic_spline import stencil
from ...sensors.calibration import Calibration
from ...sensors.camera import Camera
from ...sensors.gel_shape import shape_of

# m, thickness: the maker's guide cuts it from 4 mm; units that GelSight sells have 5.5 mm, the design file 6.15 mm
# (github.com/facebookresearch/digit-design, issues 12 and 38). 4 or 6 mm in place of 3 moves gel by under .02 px.
ACRYLIC = 4e-3
_SINES = np.linspace(0, 0.999, 2000)  # of rays in air, for the table that inverts Snell's law


def window_height(camera: Camera) -> float:
    """Return the height of the window's outer side, toward the camera: m over the plane of height zero."""
    return shape_of(camera.sensor).back_y - camera.height_zero_y + ACRYLIC


def air_over_window(camera: Camera, index: float) -> float:
    """Return the thickness, m, of air between window and pinhole with which Snell's law shows the pinhole at the
    camera's apparent height, along the axis. index : refractive index of gel and window"""
    return (camera.apparent_height - window_height(camera)) / index


def apparent_height(distance: np.ndarray, camera: Camera, index: float) -> np.ndarray:
    """Return the pinhole's apparent height (...), m over height zero, for pixels that look ``distance`` (...) m aside:
    Snell's law in a flat window of refractive ``index``. A camera nearer than the window is thick keeps its height."""
    air = air_over_window(camera, index)
    if air <= 0:
        return np.full(np.shape(distance), camera.apparent_height)
    in_gel = tangent(_SINES / index)  # slopes of rays in the gel; the next line finds the one that ends at the distance
    slope = np.interp(distance, air * tangent(_SINES) + window_height(camera) * in_gel, in_gel)
    return np.where(slope > 0, distance / np.where(slope > 0, slope, 1), camera.apparent_height)


def tangent(sine: np.ndarray) -> np.ndarray:
    """Return the tangents (...) of angles given by their ``sine`` (...)."""
    return sine / np.sqrt(1 - sine**2)


def through_window(picture: np.ndarray, height: np.ndarray, unit: Calibration) -> np.ndarray:
    """Return a pinhole's picture (H, W, k) as seen through the window, float32. height : (H, W) m, seen by its
    pixels"""
    camera = unit.camera
    right, down = np.meshgrid(camera.right, camera.down)
    nearer = 1 - height / apparent_height(np.hypot(right, down), camera, unit.gel_index)
    # The same gel point, where the pinhole's picture shows it: off by a third of a pixel at most, so the height holds.
    scale = nearer / (1 - height / camera.apparent_height)
    column = right * scale / camera.pixel_size[0] + camera.width / 2 - 0.5
    row = down * scale / camera.pixel_size[1] + camera.height / 2 - 0.5
    return cubic(picture, row, column)


def cubic(picture: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Interpolate a picture (h, w, k) at fractional ``row``, ``column`` (...), pixels, by Catmull-Rom splines: exact at
    whole pixels; places beyond the edge take the edge's value. Returns (..., k) float32."""
    nodes, weights = stencil(picture.shape[:2], np.stack([row.ravel(), column.ravel()]), closed=False)
    found = np.einsum("abn,abnk->nk", weights, picture.reshape(-1, picture.shape[2])[nodes])
    return found.reshape(*row.shape, -1).astype(np.float32)


def camera_rays(unit: Calibration, right: np.ndarray, down: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return starts and unit directions, (3, n) float32 each, of the rays to places of height zero: right, up, toward
    the camera, mm. Rays start at the window's outer side; at the camera if that is nearer than the window is thick.
    right, down : (n,) m, the places"""
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
