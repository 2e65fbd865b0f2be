"""Our own integrator for Mitsuba's scenes: a few even points of each emitter, smoothed shadows, one coarse bounce.

It uses the scene's own emitters and materials, so that Mitsuba's path integrator converges to the same picture. A
sphere's points are a ring that halves its solid angle: with Lambert's law and no occluder, their mean is exact. Nothing
here is random.

Light that a glossy coating mirrors onto other gel is followed forward from the mirroring place: beside a print's rim
the highlights of the flank above are so narrow that directions sampled from the lit place miss them. ``mirrored``
counts light near the mirror's direction (half vectors within the lobe), ``bounced`` all other: each path once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...sensors.calibration import DIFFUSE, PRINCIPLED, Coating

RING = 0.5  # share of a sphere's solid angle inside the ring
RINGS, SPOKES = 4, 4  # directions of bounced light, even in solid angle, as most of it arrives at low elevations
DIRECTIONS = RINGS * SPOKES


class EmitterLight(NamedTuple):
    """Light of one emitter that surface points reflect: unobstructed (``open``), and the share that is not blocked."""

    open: Any
    share: Any


def direct(
    mi: Any, scene: Any, emitters: Sequence[Any], hit: Any, points: int, phase: Any, lobe: Any = None
) -> list[EmitterLight]:
    """Return the light of each of the emitters at surface interactions ``hit``, from ``points`` points on the emitter.
    mi : Mitsuba's module; scene : what blocks light; phase : 0..1, shifts the points, in shares of their distance
    lobe : cosine of the half vector beyond which light near the mirror's direction is left out; None for none"""
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
        found.append(EmitterLight(free, share))
    return found


def bounced(
    mi: Any, meet: Callable[[Any], Any], scene: Any, emitters: Sequence[Any], hit: Any, phase: Any, lobe: Any = None
) -> np.ndarray:
    """Return the radiance (n, 3) at n surface interactions of light that one other place has reflected onto them.
    mi : Mitsuba's module; meet : function that intersects rays; scene : what blocks light; emitters : lights
    hit : the interactions, each 16 times; phase : 0..1 of each, rotates its directions
    lobe : cosine of the half vector at the reflecting place beyond which light is left out, or None"""
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


NARROW = 0.2  # largest GGX alpha of a narrow lobe: ``bounced``'s directions resolve wider ones
REACH = 2.0  # tangent of the half vector's angle at a lobe's end, over alpha: 80 % of its facets
STEEPEST = 0.05  # least cosine between a pixel's surface and the camera


def narrow_lobe(coating: Coating) -> tuple[float, float] | None:
    """Return the GGX alpha of a coating's highlights and the cosine at their lobe's end; None if wide or absent."""
    alpha = coating.roughness**2 if coating.bsdf == PRINCIPLED else coating.roughness
    if coating.bsdf == DIFFUSE or alpha > NARROW:
        return None
    return alpha, float(1 / np.hypot(1, REACH * alpha))


def mirrored(
    mi: Any,
    meet: Callable[[Any], Any],
    scene: Any,
    emitters: Sequence[Any],
    hit: Any,
    phase: Any,
    lobe: tuple[Any, Any],
    camera_height: Any,
    to_cell: Callable[[Any], Any],
    shape: tuple[int, int],
) -> np.ndarray:
    """Return the radiance (h, w, 3) in a picture's cells of light that other places mirror onto them, not smoothed.
    mi : Mitsuba's module; meet : function that intersects rays; scene : what blocks light; shape : (h, w)
    hit : the mirroring places, each 16 times, each standing for as much of the picture as a cell of the result
    phase : 0..1 of each, rotates its directions; lobe : alpha, and the cosine at its end
    camera_height : mm; to_cell : function from a point to the (column, row) at which the camera sees it"""
    import drjit as dr

    number = mi.Float(dr.arange(mi.UInt32, dr.width(phase)) % DIRECTIONS)
    ring = dr.floor(number / SPOKES)
    turned = (number - SPOKES * ring + phase + ring / RINGS) / SPOKES
    square = mi.Point2f((ring + phase) / RINGS, turned - dr.floor(turned))
    facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, lobe[0], True)
    material, context = hit.bsdf(), mi.BSDFContext()
    found = []
    for emitter in emitters:
        toward, weight = emitter.sample_direction(hit, mi.Point2f(RING, (number + phase) / DIRECTIONS), True)
        arriving = hit.to_local(toward.d)
        facet, density = facets.sample(arriving, square)
        leaving, density = mi.reflect(arriving, facet), density / (4 * dr.dot(arriving, facet))
        counts = hit.is_valid() & (arriving.z > 0) & (leaving.z > 0) & (facet.z >= lobe[1]) & (density > 0)
        seen = mi.SurfaceInteraction3f(hit)
        seen.wi = leaving
        power = material.eval(context, seen, arriving) * weight * leaving.z / (density * DIRECTIONS)
        ray = hit.spawn_ray(hit.to_world(leaving))
        ray.maxt = dr.select(counts, ray.maxt, 0)
        far = meet(ray)
        counts &= far.is_valid() & (far.wi.z > 0)
        counts &= ~scene.ray_test(hit.spawn_ray_to(toward.p), counts)
        incoming = mi.Vector3f(far.wi)  # a copy: the next line writes over it
        far.wi = far.to_local(dr.normalize(mi.Point3f(0, 0, camera_height) - far.p))
        shown = far.bsdf().eval(context, far, incoming) / dr.maximum(incoming.z, 1e-3)
        # Surface in a cell: larger where it is farther from the camera or steep.
        areas = dr.square((camera_height - hit.p.z) / (camera_height - far.p.z))
        areas *= dr.maximum(far.sh_frame.n.z, STEEPEST) / dr.maximum(hit.sh_frame.n.z, STEEPEST)
        found.append((to_cell(far.p), dr.select(counts, power * shown * areas, 0)))
    dr.eval(*[part for pair in found for part in pair])
    return sum((_deposited(np.array(cell), np.array(light), shape) for cell, light in found), np.zeros((*shape, 3)))


def _deposited(cell: np.ndarray, light: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the sum (h, w, 3) of light (3, n), each shared among the four cells around its (column, row) of cell (2,
    n). Numpy sums in one order, Mitsuba's threads in another each time."""
    some = light.any(0)
    light, (column, row) = light[:, some], cell[:, some]
    left, upper = np.floor(column).astype(int), np.floor(row).astype(int)
    total = np.zeros((3, shape[0] * shape[1]))
    for right in (0, 1):
        for down in (0, 1):
            share = (1 - np.abs(column - left - right)) * (1 - np.abs(row - upper - down))
            at_row, at_column = upper + down, left + right
            inside = (at_row >= 0) & (at_row < shape[0]) & (at_column >= 0) & (at_column < shape[1])
            at = (at_row * shape[1] + at_column)[inside]
            for band in range(3):
                total[band] += np.bincount(at, (light[band] * share)[inside], total.shape[1])
    return total.T.reshape(*shape, 3)
