"""Radiance of the gel without LLVM: Mitsuba traces rays one by one, to points that stand for each light.

Interreflection is gathered in numpy. The gel is a height field: along each azimuth a place sees the gel that rises
above its horizon. Marching outward, every step that raises the horizon adds its radiance times the projected solid
angle of the rise. None of that is random or needs Mitsuba; the tests compare it with Mitsuba's path tracer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...sensors.calibration import Calibration
from ...sensors.camera import Led
from ..cast_shadows import bounding_box
from ..coating_spread import evened
from ..light import Surface, falling, lambert, open_light
from ..perspective import lookup, map_lookup, slopes
from ..presets import Gather, Preset
from .gel_light import ASIDE
from .gel_mesh import MARGIN, GelMesh
from .tracer import Tracer
from .window import through_window

_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # of a sunflower's seeds: even over a disc for any number of them
_GOLDEN_RATIO = (np.sqrt(5) - 1) / 2
# Steps of the additive recurrence that fills four dimensions evenly (M. Roberts, 2018: powers of 1 / g, g^5 = g + 1).
_EVEN = 1 / 1.1673039782614187 ** np.arange(1, 5)


class MatteLight:
    """Radiance of a gel with a matte coating by one of Mitsuba's presets without LLVM; arguments are not checked.
    rest : (H, W) m, heights to start with; seed : of the light points"""

    def __init__(self, unit: Calibration, preset: Preset, rest: np.ndarray, seed: int) -> None:
        self.unit, self.preset = unit, preset
        self._tracer = Tracer(GelMesh(unit.camera, preset.spacing, square=True), rest)
        self._start = np.random.default_rng(seed).random(4)

    def radiance(self, height_map: np.ndarray) -> np.ndarray:
        """Return the radiance (H, W, LED) float32, levels, of a height_map (H, W) m."""
        height = np.asarray(height_map, np.float32)
        return self.completed(height, *self.direct(height))

    def direct(self, height: np.ndarray) -> tuple[np.ndarray, Surface]:
        """Return the radiance (H, W, LED) float32, by LEDs alone, of ``height`` (H, W) m, and the surface that pixels
        see."""
        self._tracer.load(height)
        tilt = slopes(height, self.unit.camera)
        total, first = self._one_pass(0, tilt)
        for number in range(1, self.preset.passes):
            total += self._one_pass(number, tilt)[0]
        return total / np.float32(self.preset.passes), first

    def completed(self, height: np.ndarray, direct: np.ndarray, hits: Surface) -> np.ndarray:
        """Return the radiance (H, W, LED) with the preset's other effects: interreflection, refraction at the window.
        height : (H, W) m, of the gel; direct, hits : what the method ``direct`` returned for it"""
        radiance, preset = direct, self.preset
        if preset.gather and any(self.unit.coating.albedo):
            radiance = direct + interreflection(height, direct, hits, self.unit, preset.gather)
        return through_window(radiance, hits.height, self.unit) if preset.window else radiance

    def _one_pass(self, number: int, tilt: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, Surface]:
        """Return direct light (H, W, 3) of pass ``number``, from 0, and the surface that pixels saw.
        tilt : slopes (H, W) of the height map to the right, and down"""
        leds, count = self.unit.leds, self.preset.points
        if self.preset.passes == 1:
            shift, points = ASIDE, [light_points(led, count) for led in leds]
        else:
            right, down, turn, depth = (self._start + number * _EVEN) % 1
            shift = (right - 0.5, down - 0.5)
            points = [sphere_points(led, count, turn, depth) for led in leds]
        place, seen = self._tracer.trace(np.concatenate(points), shift)
        right, down, height = np.ascontiguousarray(np.moveaxis(place, -1, 0))
        look_up = map_lookup(right, down, self.unit.camera)
        hits = Surface(right, down, height, look_up(tilt[0]), look_up(tilt[1]))
        return direct_light(hits, seen, points, self.unit, soften=self.preset.passes == 1), hits


def direct_light(
    hits: Surface, seen: np.ndarray, points: Sequence[np.ndarray], unit: Calibration, *, soften: bool
) -> np.ndarray:
    """Return the radiance (H, W, L) float32, levels, of L LEDs on a matte coating; hits : the surface that pixels see
    seen : (H, W) uint32, one bit for each visible point; points : (n, 3) m of each LED, n <= 8, in the bits' order
    soften : true smooths the steps of few points in a shadow's edge, over 3 x 3 pixels"""
    positions, bit = np.array([led.position for led in unit.leds]), 0
    lit, radiance = lambert(hits, positions), np.empty((*hits.height.shape, len(positions)), np.float32)
    for k, (facing, cloud) in enumerate(zip(lit.facing, points, strict=True)):
        part = (seen >> np.uint32(bit)) & np.uint32(2 ** len(cloud) - 1)
        _dim(facing, hits, part, cloud, soften)
        level = np.float32(np.square(positions[k]).sum() * unit.facing[k])
        radiance[..., k] = falling(np.maximum(facing, 0), lit.square[k], lit.length, level)
        bit += len(cloud)
    return radiance


def _dim(facing: np.ndarray, hits: Surface, seen: np.ndarray, cloud: np.ndarray, soften: bool) -> None:
    """Replace ``facing`` (H, W), cosine times distance of a light's middle, in place, by the mean over its visible
    points. These are so close together that only their direction differs: n . (l + d), d from the middle to a point.
    seen : (H, W) uint32, bit k for point k visible; cloud : (n, 3) m, the points; soften : smooth over 3 x 3 pixels"""
    every = 2 ** len(cloud) - 1
    box = bounding_box(seen != every, margin=1)
    if box is None:
        return
    codes = (np.arange(every + 1)[:, None] >> np.arange(len(cloud))) & 1
    offsets = codes @ (cloud - cloud.mean(0)) / len(cloud)
    tables = np.column_stack([codes.mean(1), offsets]).astype(np.float32).T
    share, right, down, above = (table.take(seen[box]) for table in tables)
    if soften:
        share, right, down, above = (evened(values) for values in (share, right, down, above))
    facing[box] *= share
    facing[box] += above - hits.slope_right[box] * right - hits.slope_down[box] * down


def light_points(led: Led, count: int) -> np.ndarray:
    """Return points (count, 3) m, image frame, that stand for an LED: a ring around its middle that faces the picture's
    middle, with sqrt(1/2) of its radius and so the second moments of an even disc."""
    angle = 2 * np.pi * np.arange(count) / count
    return led.position + led.radius * np.sqrt(0.5) * _across(led, np.cos(angle), np.sin(angle))


def sphere_points(led: Led, count: int, turn: float, depth: float) -> np.ndarray:
    """Return points (count, 3) m, image frame, that together shine like an evenly bright sphere.

    They fill the ball with density 1 / sqrt(1 - r^2), which shows an even disc to every side (Abel's transform).
    Without occluders such a cloud lights exactly as its middle would: the light of a point falls on a surface as the
    gradient of 1 / distance, to which Newton's shell theorem applies. Seen from the picture's middle they are a
    sunflower's seeds.
    turn, depth : 0..1, where the pattern starts, across and along the line from the picture's middle"""
    number = np.arange(count)
    radius = np.sqrt((number + (turn * 7 % 1)) / count)  # the rings move as the pattern turns
    angle = number * _GOLDEN_ANGLE + 2 * np.pi * turn
    along = np.sqrt(1 - radius**2) * np.sin(2 * np.pi * (number * _GOLDEN_RATIO + depth))
    toward = np.asarray(led.position) / np.linalg.norm(led.position)
    seeds = _across(led, radius * np.cos(angle), radius * np.sin(angle)) + np.outer(along, toward)
    return led.position + led.radius * seeds


def _across(led: Led, aside: np.ndarray, upward: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) across the line from the LED to the picture's middle: ``aside`` (n,) times a level unit
    vector, and ``upward`` (n,) times one that leans away from the gel."""
    toward = np.asarray(led.position) / np.linalg.norm(led.position)
    side = np.cross(toward, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    return np.outer(aside, side) + np.outer(upward, np.cross(side, toward))


REACH = 16e-3  # m, the whole picture and its rim: in a bowl each distance contributes equally


def interreflection(
    height: np.ndarray, direct: np.ndarray, hits: Surface, unit: Calibration, gather: Gather
) -> np.ndarray:
    """Return the radiance (H, W, LED) float32 that light from the gel itself adds to the pixels.
    height : (H, W) m; direct : (H, W, LED) radiance of the pixels without it; hits : the surface that they see
    gather : resolution of the sum"""
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
    """Return the radiance (h, w, 3) of a coarse map of gel: the picture's inside, unshadowed on the rim, 0 beyond.
    height : (h, w) m; right : (w,), down : (h,) m, its axes; margin : cells on each side that lie outside the picture
    direct : (H, W, 3) radiance of the picture by the LEDs alone"""
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
    """Return the irradiance (h - 2 margin, w - 2 margin, 3) by the gel itself, over pi: in the unit of radiance.

    (1 / pi) times the integral of L (n . w) dw over directions w that meet gel: for each azimuth, L times the weighted
    solid angle between each horizon and the next.
    height : (h, w) m; radiance : (h, w, 3); spacing : (right, down) m
    margin : places on each side that give light and receive none; the search goes 2 less far"""
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
    """Return the cosine-weighted solid angle (...) below an elevation, per radian of azimuth and up to a constant:
    integral of (n . w) cos(e) de from -90 degrees, w = (cos e, sin e) and n = (aside, level) (...) in the plane of the
    azimuth. tangent : (...), of the elevation"""
    share = tangent / (1 + tangent * tangent)
    return 0.5 * (aside * (np.arctan(tangent) + share) + level * (tangent * share))


def _distances(step: float, reach: float, growth: float) -> list[float]:
    distances, at = [], step
    while at <= reach:
        distances.append(at)
        at += max(step, growth * at)
    return distances


def _shifted(field: np.ndarray, right: float, down: float, margin: int) -> np.ndarray:
    """Return the field (h, w, k) shifted by right and down, fractions of cells, without its margin of cells."""
    column, row = int(np.floor(right)), int(np.floor(down))
    s, t = np.float32(right - column), np.float32(down - row)
    height, width = field.shape[0] - 2 * margin, field.shape[1] - 2 * margin
    rows = field[margin + row : margin + row + height + 1, margin + column : margin + column + width + 1]
    upper = rows[:, :-1] + s * (rows[:, 1:] - rows[:, :-1])
    return upper[:-1] + t * (upper[1:] - upper[:-1])
