"""An integrator of our own for Mitsuba: a few even points of each emitter, shadows evened out, one coarse bounce.

It asks the scene's emitters and materials, so whatever shines or is painted takes part; Mitsuba's path integrator,
given time, makes the same picture. A sphere's points are a ring that halves its solid angle: with Lambert's law and
nothing in the way, their mean is exact. Nothing here is random.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

NAME = "tactile_leds"
RING = 0.5  # share of a sphere's solid angle inside the ring
RINGS, SPOKES = 4, 4  # directions of light that arrives by a bounce: even in solid angle, as most of it comes in low
DIRECTIONS = RINGS * SPOKES


class Lit(NamedTuple):
    """Light of one emitter: its unoccluded radiance, and the share that arrives."""

    open: Any
    share: Any


def direct(
    mi: Any, scene: Any, emitters: Sequence[Any], hit: Any, points: int, phase: Any, lobe: Any = None
) -> list[Lit]:
    """Compute the light of each emitter at surface interactions, by a number of points on the emitter.

    scene : what stands in the way; phase : 0..1, turns the points, in shares of their distance
    lobe : cosine of the half vector from which on light is left out, near the mirror's direction; None for none
    """
    import drjit as dr

    material, found = hit.bsdf(), []
    for emitter in emitters:
        free, arrived = mi.Color3f(0), mi.Color3f(0)
        delta = mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta)
        count = 1 if delta else points
        for k in range(count):
            toward, weight = emitter.sample_direction(hit, mi.Point2f(RING, (k + phase) / count), True)
            local = hit.to_local(toward.d)
            light = material.eval(mi.BSDFContext(), hit, local) * weight / count
            if lobe is not None:
                light = dr.select(dr.normalize(local + hit.wi).z < lobe, light, 0)
            blocked = scene.ray_test(hit.spawn_ray_to(toward.p), dr.any(light > 0))
            free += light
            arrived += dr.select(blocked, 0, light)
        share = dr.select(dr.sum(free) > 0, dr.sum(arrived) / dr.sum(free), 0)
        found.append(Lit(free, share))
    return found


def bounced(
    mi: Any, meet: Callable[[Any], Any], scene: Any, emitters: Sequence[Any], hit: Any, phase: Any, lobe: Any = None
) -> np.ndarray:
    """Radiance (n, 3) that n surface interactions show of light that came by one other place.

    meet : what rays meet; hit : each of them DIRECTIONS times, one behind the other
    phase : 0..1 of each, turns its directions; lobe : as ``direct`` has it, of the other place
    """
    import drjit as dr

    number = dr.arange(mi.UInt32, dr.width(phase)) % DIRECTIONS
    ring, spoke = mi.Float(number // SPOKES), mi.Float(number % SPOKES)
    square = mi.Point2f((ring + phase) / RINGS, (spoke + phase + ring / RINGS) / SPOKES)
    local = mi.warp.square_to_uniform_hemisphere(mi.Point2f(square.y - dr.floor(square.y), square.x))
    own = hit.bsdf().eval(mi.BSDFContext(), hit, local) * (2 * dr.pi)
    far = meet(hit.spawn_ray(hit.to_world(local)))
    light = mi.Color3f(0)
    for lit in direct(mi, scene, emitters, far, 1, (mi.Float(number) + 0.5) / DIRECTIONS, lobe):
        light += dr.select(far.is_valid() & dr.any(own > 0), lit.open * lit.share, 0)
    light *= own
    dr.eval(light)  # else each sum would trace the rays again, by a kernel of its own
    sums = [dr.block_sum(light[k], DIRECTIONS) for k in range(3)]
    dr.eval(*sums)
    return np.stack([np.array(each) for each in sums], -1) / DIRECTIONS


@functools.cache
def register(mi: Any, variant: str) -> None:
    """Make the integrator known to a variant of Mitsuba, by ``NAME``: direct light of each ray, for scene files too."""

    class LedIntegrator(mi.SamplingIntegrator):
        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.points = properties.get("points", 4)

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> tuple:
            """Return the direct light of each ray; called by Mitsuba."""
            hit = scene.ray_intersect(ray, active)
            light = mi.Color3f(0)
            for lit in direct(mi, scene, scene.emitters(), hit, self.points, sampler.next_1d()):
                light += lit.open * lit.share
            return light, hit.is_valid(), []

        def to_string(self) -> str:
            """Return the integrator's name, which Mitsuba prints."""
            return f"LedIntegrator[points={self.points}]"

    mi.register_integrator(NAME, LedIntegrator)
