"""Light that the white coating throws onto itself: what each place of the gel receives from the gel that it sees.

The gel is a height field, so along each azimuth a place sees what rises above all that lies before it. Marching
outward, every step that raises the horizon adds its radiance times the projected solid angle of the rise. Nothing is
random, and Mitsuba is not needed: the tests hold it against Mitsuba's path tracer.
"""

from __future__ import annotations

import numpy as np

from ...sensors.calibration import Calibration
from ..light import Surface, open_light
from ..perspective import lookup, map_lookup
from ..presets import Gather
from .gel_mesh import MARGIN

REACH = 16e-3  # m: across a bowl every distance gives as much, so the whole picture and its rim count


def interreflection(
    height: np.ndarray, direct: np.ndarray, hits: Surface, unit: Calibration, gather: Gather
) -> np.ndarray:
    """Return the radiance (H, W, 3) float32 that the gel's own light adds to what pixels see.

    height : (H, W) m; direct : (H, W, 3) radiance of the pixels by the LEDs alone; hits : what they see
    """
    camera, step = unit.camera, gather.step
    spacing = camera.pixel_size[0] * step, camera.pixel_size[1] * step
    first = step // 2
    coarse = height[first::step, first::step]
    margin = int(np.ceil(REACH / min(spacing))) + 2
    coarse = np.pad(coarse, margin, mode="edge")
    right = _axis(camera.right[first], spacing[0], coarse.shape[1], margin)
    down = _axis(camera.down[first], spacing[1], coarse.shape[0], margin)
    radiance = _on_gel(coarse, right, down, direct, unit, margin)
    inside = slice(margin, -margin), slice(margin, -margin)
    own = radiance[inside].copy()
    received = np.zeros_like(own)
    for _ in range(gather.bounces):
        received = irradiance(coarse, radiance, margin, spacing, gather) * np.asarray(unit.coating.albedo, np.float32)
        radiance[inside] = own + received
    row = (hits.down - np.float32(camera.down[first])) * np.float32(1 / spacing[1])
    column = (hits.right - np.float32(camera.right[first])) * np.float32(1 / spacing[0])
    look_up = lookup(row, column, received.shape[:2])
    return np.stack([look_up(received[..., k]) for k in range(3)], -1)


def _axis(first: float, step: float, count: int, margin: int) -> np.ndarray:
    return (first + step * (np.arange(count) - margin)).astype(np.float32)


def _on_gel(
    height: np.ndarray, right: np.ndarray, down: np.ndarray, direct: np.ndarray, unit: Calibration, margin: int
) -> np.ndarray:
    """Radiance (h, w, 3) of a coarse map of the gel: the picture's inside it, open light on the rim, 0 beyond."""
    camera = unit.camera
    right, down, flat = right[None, :], down[:, None], np.zeros_like(height)
    radiance = np.moveaxis(open_light(Surface(right, down, height, flat, flat), unit), 0, -1).copy()
    outside = np.maximum(np.abs(right) - camera.right[-1], np.abs(down) - camera.down[-1])
    radiance[outside > MARGIN] = 0
    inside = slice(margin, -margin), slice(margin, -margin)
    nearer = 1 / (1 - height[inside] / camera.apparent_height)
    look_up = map_lookup(right[:, inside[1]] * nearer, down[inside[0]] * nearer, camera)
    radiance[inside] = np.stack([look_up(direct[..., k]) for k in range(3)], -1)
    return radiance


def irradiance(
    height: np.ndarray, radiance: np.ndarray, margin: int, spacing: tuple[float, float], gather: Gather
) -> np.ndarray:
    """Return the irradiance (h - 2 margin, w - 2 margin, 3) by the gel itself, in the unit of radiance.

    height : (h, w) m; radiance : (h, w, 3); margin : places on each side that only give light, as far as is looked
    spacing : (right, down) m
    """
    field = np.concatenate([height[..., None], radiance], -1).astype(np.float32)
    inside = slice(margin, -margin), slice(margin, -margin)
    slopes = [slope[inside] for slope in np.gradient(height, spacing[1], spacing[0])]
    level = (1 / np.sqrt(1 + slopes[0] ** 2 + slopes[1] ** 2)).astype(np.float32)
    own, here = height[inside], radiance[inside]
    received = np.zeros_like(here)
    distances = _distances(min(spacing), (margin - 2) * min(spacing), gather.growth)
    for k in range(gather.azimuths):
        angle = 2 * np.pi * (k + 0.5) / gather.azimuths
        toward = np.cos(angle), np.sin(angle)
        # The gel's own tangent is the first horizon.
        tangent = (toward[0] * slopes[1] + toward[1] * slopes[0]).astype(np.float32)
        aside, before = -tangent * level, here
        weight = _weight(tangent, aside, level)
        for distance in distances:
            at = _shifted(field, toward[0] * distance / spacing[0], toward[1] * distance / spacing[1], margin)
            tangent = np.maximum(tangent, (at[..., 0] - own) * np.float32(1 / distance))
            higher = _weight(tangent, aside, level)
            received += (higher - weight)[..., None] * (at[..., 1:] + before)
            weight, before = higher, at[..., 1:]
    # A segment's radiance is the mean of its ends; an azimuth stands for 2 pi / azimuths, and Lambert's law for 1 / pi.
    return received * np.float32(0.5 * 2 / gather.azimuths)


def _weight(tangent: np.ndarray, aside: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Cosine-weighted solid angle below an elevation, a radian of azimuth: integral of (n . w) cos(e) de from -90.

    With w = (cos e, sin e) in the plane of the azimuth and n = (aside, level) there; up to a constant.
    """
    share = tangent / (1 + tangent * tangent)
    return 0.5 * (aside * (np.arctan(tangent) + share) + level * (tangent * share))


def _distances(step: float, reach: float, growth: float) -> list[float]:
    distances, at = [], step
    while at <= reach:
        distances.append(at)
        at += max(step, growth * at)
    return distances


def _shifted(field: np.ndarray, right: float, down: float, margin: int) -> np.ndarray:
    """The field (h, w, k) seen from each place a fractional number of cells away, without its margin."""
    column, row = int(np.floor(right)), int(np.floor(down))
    s, t = np.float32(right - column), np.float32(down - row)
    height, width = field.shape[0] - 2 * margin, field.shape[1] - 2 * margin
    rows = field[margin + row : margin + row + height + 1, margin + column : margin + column + width + 1]
    upper = rows[:, :-1] + s * (rows[:, 1:] - rows[:, :-1])
    return upper[:-1] + t * (upper[1:] - upper[:-1])
