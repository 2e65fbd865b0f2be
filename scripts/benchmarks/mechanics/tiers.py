"""Compare the fast and the full tier with the reference tier on both sensors: error and time, deeper and deeper."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from tactile_core import accuracy
from tactile_core.accuracy import Row, row
from tactile_core.geometry.cubic_spline import EvenSpline
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.placement import FRICTION, Placement, pose_at, thickness_under
from tactile_core.mechanics.solve import TIERS, Sensor, Solution, Step, Tier, solve_path
from tactile_core.sensors import digit_surface

# Targets (docs/sources.md, Targets): um rms and percent; the fast tier's shape up to 20 % depth, its force up to 40 %.
SHAPE_TARGET, FAST_FORCE_TARGET, FULL_FORCE_TARGET = 5.0, 5.0, 1.0
NORMAL_TARGET = 1.5  # degrees, mean inside the contact, point 2
TIME_TARGETS = {("fast", "digit"): 2.5, ("fast", "biotac"): 3.5, ("full", "digit"): 1000.0, ("full", "biotac"): 1200.0}
_BALL, _PLACE = Sphere(3.5e-3), Placement(-8e-3, 2e-3, 0.1, 1.0)
_DEPTHS = {"digit": (0.2, 0.4, 0.6, 0.8, 1.2), "biotac": (0.3, 0.6, 0.9, 1.2)}  # mm


def rows(quick: bool) -> Iterator[Row]:
    """Yield the tiers' errors and times under a ball of 7 mm diameter at one place, at all depths, and at one of them
    with friction too. quick : at one depth per sensor, without friction"""
    for sensor in ("digit", "biotac"):
        depths = _DEPTHS[sensor][1:2] if quick else _DEPTHS[sensor]
        yield from _sensor(sensor, [1e-3 * d for d in depths], 0.0)
        if not quick:
            yield from _sensor(sensor, [1e-3 * depths[2]], FRICTION)


def thickness_of(sensor: Sensor) -> float:
    """Return the sensor's thickness, m, under this check's ball."""
    return thickness_under(sensor, _BALL, pose_at(sensor, _BALL, _PLACE))


def _sensor(sensor: Sensor, depths: list[float], friction: float) -> Iterator[Row]:
    """Yield errors and times of a sensor's contacts at depths, m. friction : Coulomb's coefficient"""
    list(_timed(sensor, "fast", depths[:1], friction))  # the matrices are read, the code is compiled
    solved = {tier: list(_timed(sensor, tier, depths, friction)) for tier in TIERS}
    rubbed = f"_friction_{friction:g}" if friction else ""
    for k, depth in enumerate(depths):
        exact, took = solved["reference"][k]
        yield row(f"{sensor}_reference_{depth * 1e3:.1f}mm{rubbed}_time", took, "s", of="from rest, with its mesh")
        for tier in TIERS[:-1]:
            found, took = solved[tier][k]
            where = f"{sensor}_{tier}_{depth * 1e3:.1f}mm{rubbed}"
            yield from _compare(where, tier, found, exact, depth / thickness_of(sensor))
            if sensor == "digit":
                yield from _normal_error(where, found, exact)
            target = TIME_TARGETS[tier, sensor] if not friction else None
            yield row(f"{where}_time", 1e3 * took, "ms", target, of="from rest, with its mesh or block")


def _timed(sensor: Sensor, tier: Tier, depths: list[float], friction: float) -> Iterator[tuple[Solution, float]]:
    """Yield the contact at each of the depths, m, and its CPU s. Each is solved from rest, on a mesh of its own.
    friction : Coulomb's coefficient"""
    for depth in depths:
        began = time.process_time()
        yield next(solve_path(sensor, _BALL, _PLACE, [Step(depth)], tier, friction)), time.process_time() - began


def gel_normals(displacement: np.ndarray) -> np.ndarray:
    """Return unit normals (201, 153, 3) of a gel in the camera's view under displacement (n, 3) m, by cubic splines."""
    surface = digit_surface()
    grid = surface.grid(surface.rest + displacement)[surface.window]
    splines = [EvenSpline(0.0, 1.0, size) for size in grid.shape[:2]]
    fine = [np.linspace(0, spline.count - 1, 4 * spline.count - 3) for spline in splines]
    (r, dr), (c, dc) = ([s.matrix(at), s.matrix(at, 1)] for s, at in zip(splines, fine, strict=True))
    along, across = (np.einsum("ra,abk,cb->rck", p, grid, q, optimize=True) for p, q in ((dr, c), (r, dc)))
    normal = np.cross(along, across)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _normal_error(where: str, found: Solution, exact: Solution) -> Iterator[Row]:
    """Yield mean and largest angle between true and found normals in contact, degrees; baseline: of a gel at rest."""
    surface = digit_surface()
    patch = surface.grid(exact.contact_patch[:, None].astype(float))[surface.window][..., 0]
    fine = np.kron(patch > 0, np.ones((4, 4), bool))[: 4 * patch.shape[0] - 3, : 4 * patch.shape[1] - 3]
    theirs = gel_normals(exact.displacement)[fine]
    angles = [
        np.degrees(np.arccos(np.clip(np.einsum("ni,ni->n", gel_normals(moved)[fine], theirs), -1, 1)))
        for moved in (found.displacement, np.zeros_like(found.displacement))
    ]
    baseline_mean, baseline_max = float(angles[1].mean()), float(angles[1].max())
    of = "gel inside the contact, 7 mm ball"
    yield row(f"{where}_normals_mean", float(angles[0].mean()), "degree", NORMAL_TARGET, baseline=baseline_mean, of=of)
    yield row(f"{where}_normals_max", float(angles[0].max()), "degree", baseline=baseline_max, of=of)


def _compare(where: str, tier: Tier, found: Solution, exact: Solution, share: float) -> Iterator[Row]:
    error, baseline = (
        1e6 * float(accuracy.rms_in_contact(moved[None], exact.displacement[None])[0])
        for moved in (found.displacement, np.zeros_like(exact.displacement))
    )
    largest = 1e6 * float(accuracy.max_error(found.displacement[None], exact.displacement[None])[0])
    of = f"7 mm ball, one place, against the {exact.tier} tier"
    wanted = SHAPE_TARGET if tier == "full" or share <= 0.2 else None
    yield row(f"{where}_shape_rms", error, "um", wanted, baseline=baseline, of=of)
    yield row(f"{where}_shape_max", largest, "um", of=of)
    off = 100 * (np.linalg.norm(found.force) / np.linalg.norm(exact.force) - 1)
    wanted = FULL_FORCE_TARGET if tier == "full" else FAST_FORCE_TARGET if share <= 0.4 else None
    yield row(f"{where}_force_error", float(off), "percent", wanted, baseline=-100.0, of=of)
