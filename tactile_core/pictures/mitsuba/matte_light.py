"""Radiance of the gel without LLVM: Mitsuba traces rays one by one, to points that stand for each light."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...sensors.calibration import Calibration
from ...sensors.camera import Led
from ..cast_shadows import bounding_box
from ..coating_spread import evened
from ..light import Surface, falling, lambert
from ..perspective import map_lookup, slopes
from ..presets import Preset
from .gel_light import ASIDE
from .gel_mesh import GelMesh
from .interreflection import interreflection
from .tracer import make_tracer
from .window import through_window

_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # of a sunflower's seeds: even over a disc for any number of them
_GOLDEN_RATIO = (np.sqrt(5) - 1) / 2
# Steps of the additive recurrence that fills four dimensions evenly (M. Roberts, 2018: powers of 1 / g, g^5 = g + 1).
_EVEN = 1 / 1.1673039782614187 ** np.arange(1, 5)


class MatteLight:
    """Radiance by one of Mitsuba's presets without LLVM, on a matte coating; arguments checked by the caller."""

    def __init__(self, unit: Calibration, preset: Preset, variant: str, rest: np.ndarray, seed: int) -> None:
        self.unit, self.preset = unit, preset
        self._tracer = make_tracer(GelMesh(unit.camera, preset.spacing, square=True), rest, variant)
        self._start = np.random.default_rng(seed).random(4)

    def radiance(self, height_map: np.ndarray) -> np.ndarray:
        """Return the radiance (H, W, 3) float32, levels, of heights (H, W) m."""
        height = np.asarray(height_map, np.float32)
        return self.completed(height, *self.direct(height))

    def direct(self, height: np.ndarray) -> tuple[np.ndarray, Surface]:
        """Return the radiance (H, W, 3) float32 by the LEDs alone, of heights (H, W), and what the first pass saw."""
        self._tracer.load(height)
        tilt = slopes(height, self.unit.camera)
        total, first = self._one_pass(0, tilt)
        for number in range(1, self.preset.passes):
            total += self._one_pass(number, tilt)[0]
        return total / np.float32(self.preset.passes), first

    def completed(self, height: np.ndarray, direct: np.ndarray, hits: Surface) -> np.ndarray:
        """Return the direct light with the preset's other effects: interreflection, and the window's refraction."""
        radiance, preset = direct, self.preset
        if preset.gather and any(self.unit.coating.albedo):
            radiance = direct + interreflection(height, direct, hits, self.unit, preset.gather)
        return through_window(radiance, hits.height, self.unit) if preset.window else radiance

    def _one_pass(self, number: int, tilt: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, Surface]:
        """Direct light (H, W, 3) and what pixels saw."""
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
    """Return the radiance (H, W, L) float32, levels, of L LEDs on a matte coating.

    seen : (H, W) uint32, a bit a point; points : (n, 3) m of each LED, n <= 8, in the order of the bits
    soften : even out the steps that few points leave in a shadow's edge, over 3 x 3 pixels
    """
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
    """Cosine times distance of a light's middle becomes, in place, the mean over its points of those that are seen.

    They are so close together that they differ in direction alone: n . (l + d), d from the middle to the point.
    """
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
    """Return points (count, 3) m, image frame, round the light's middle, in the plane that faces the picture's middle.

    A ring with the second moments of an even disc, the best of a few points: radius sqrt(1/2).
    """
    angle = 2 * np.pi * np.arange(count) / count
    return led.position + led.radius * np.sqrt(0.5) * _across(led, np.cos(angle), np.sin(angle))


def sphere_points(led: Led, count: int, turn: float, depth: float) -> np.ndarray:
    """Return the points (count, 3) m, image frame, of a cloud that shines as an evenly bright sphere does.

    They fill the ball with density 1 / sqrt(1 - r^2), which shows an even disc to every side (Abel's transform).
    Where nothing is in the way, such a cloud lights exactly as its middle would: the light of a point falls on a
    surface as the gradient of 1 / distance, to which Newton's shell theorem applies. To the picture's middle they are
    a sunflower. turn, depth : 0..1, where the pattern starts across and along that line
    """
    number = np.arange(count)
    radius = np.sqrt((number + (turn * 7 % 1)) / count)  # the rings move as the pattern turns
    angle = number * _GOLDEN_ANGLE + 2 * np.pi * turn
    along = np.sqrt(1 - radius**2) * np.sin(2 * np.pi * (number * _GOLDEN_RATIO + depth))
    toward = np.asarray(led.position) / np.linalg.norm(led.position)
    seeds = _across(led, radius * np.cos(angle), radius * np.sin(angle)) + np.outer(along, toward)
    return led.position + led.radius * seeds


def _across(led: Led, aside: np.ndarray, upward: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) across the line to the picture's middle: aside is level, upward leans away from the gel."""
    toward = np.asarray(led.position) / np.linalg.norm(led.position)
    side = np.cross(toward, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    return np.outer(aside, side) + np.outer(upward, np.cross(side, toward))
