"""Compare each tier of contact mechanics with a finer one, contact by contact, and as a table by depth.

Random contacts that the reference tier has solved once are kept in a file, as truth for the cheaper tiers.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core import accuracy, sensors
from tactile_core.files import atomic
from tactile_core.mechanics.placement import DEPTH_LIMIT, Placement, depth_at, pose_at, surface_drop, thickness_under
from tactile_core.mechanics.solve import Sensor, Solution, Step, Tier, solve_path
from tactile_core.simulation.pairs_file import SCALE, Pairs, quantise
from tactile_core.simulation.scene import Scene
from tactile_core.training.step_errors import true_displacement

from .random_contacts import DEEPEST, RandomContact, random_contacts

SENSORS: tuple[Sensor, ...] = ("digit", "biotac")
_ALMOST = 0.999  # of the greatest depth: a rounding beyond it is refused
REPEATS = {"fast": 3, "full": 1, "reference": 1}  # of a solve, the fastest counts: the first may read and compile
Bin = dict[str, float | int]


@dataclass(frozen=True)
class Miss:
    """Error of one contact against the truth at the same depth.

    press : number of the press that the contact belongs to; share : depth divided by the thickness at first touch
    shape : rms error, m, over nodes that truly move more than 10 um; force : relative error
    baseline : m, shape error of no displacement at all
    """

    press: int
    share: float
    shape: float
    force: float
    baseline: float


def miss(press: int, share: float, found: np.ndarray, force: float, true: np.ndarray, true_force: float) -> Miss:
    """Return the error of a contact's displacement ``found`` (n, 3) m and force N against true (n, 3) m, true_force N.
    press : the number of its press; share : depth / thickness"""
    error, baseline = (
        float(accuracy.rms_in_contact(moved[None], true[None])[0]) for moved in (found, np.zeros_like(true))
    )
    return Miss(press, share, error, abs(force / true_force - 1), baseline)


def fast_misses(sensor: Sensor, pairs: Pairs, scene: Scene) -> Iterator[Miss]:
    """Yield the fast tier's errors against a scene's ``pairs``, solved by the full tier, for contacts that converge."""
    for press in np.unique(pairs.press):
        rows = np.flatnonzero(pairs.press == press)
        indenter = scene.indenters[int(pairs.indenter[rows[0]])].build()
        place = Placement(*map(float, pairs.place[rows[0]]))
        pose, turned = pose_at(sensor, indenter, place), pose_at("biotac", indenter, place)
        depths, slides = getattr(pairs, f"depth_{sensor}")[rows].astype(float), pairs.slide[rows].astype(float)
        steps = [Step(depth, slide=tuple(slide)) for depth, slide in zip(depths, slides, strict=True)]
        path = solve_path(sensor, indenter, pose, steps, friction=scene.pairs.friction, limit=1.001 * max(depths))
        for row, slide, found in zip(rows, slides, path, strict=True):
            if found.converged:
                true = true_displacement(pairs, sensor, np.array([row]))[0]
                along = float(pairs.force[row] @ turned.direction)  # the same on both sensors
                drop = surface_drop(sensors.sensor_surface(sensor), indenter, pose, pose.slid(*slide))
                share = (found.depth - drop) / found.thickness
                yield miss(int(press), share, found.displacement, found.axial_force, true, along)


def solved(sensor: Sensor, contact: RandomContact, tier: Tier) -> tuple[Solution, float, float]:
    """Solve a contact from rest, without friction; its depth, drawn up to DEEPEST, is scaled to reach DEPTH_LIMIT.
    Return the solution, its depth over the thickness, and CPU s, the least of REPEATS. Raises TactileError if it cannot
    be solved."""
    pose = pose_at(sensor, contact.indenter, contact.place)
    share = contact.depth / DEEPEST * DEPTH_LIMIT * _ALMOST
    depth, thick = depth_at(share, sensor, contact.indenter, pose), thickness_under(sensor, contact.indenter, pose)
    took = []
    for _ in range(REPEATS[tier]):
        began = time.process_time()
        found = next(solve_path(sensor, contact.indenter, contact.place, [Step(depth)], tier, 0.0))
        took.append(time.process_time() - began)
    return found, depth / thick, min(took)


def by_depth(misses: Iterable[Miss], edges: Sequence[float]) -> list[Bin]:
    """Return the errors in bins of depth over thickness, whose upper ends are ``edges``; empty bins are left out.

    depth_share_to : a bin's upper end; contacts : their number; shape_um, force : median errors, um rms and relative
    shape_95_um, force_95 : their 95 % quantiles; baseline_um : median shape error of no displacement"""
    misses, found = list(misses), []
    for low, high in itertools.pairwise((0.0, *edges)):
        here = [each for each in misses if low < each.share <= high]
        if here:
            shape, force = ([getattr(each, name) for each in here] for name in ("shape", "force"))
            found.append({
                "depth_share_to": high, "contacts": len(here),
                "shape_um": _digits(1e6 * np.median(shape)), "shape_95_um": _digits(1e6 * np.quantile(shape, 0.95)),
                "force": _digits(np.median(force)), "force_95": _digits(np.quantile(force, 0.95)),
                "baseline_um": _digits(1e6 * np.median([each.baseline for each in here])),
            })  # fmt: skip
    return found


def _digits(value: float) -> float:
    return float(f"{value:.4g}")


@dataclass(frozen=True)
class Truth:
    """A contact in the reference tier, from rest and without friction.

    number : of the random contact that the file's seed draws; share : depth over the thickness
    displacement : (n, 3) m; force : N; seconds : of CPU, to solve it
    """

    number: int
    contact: RandomContact
    share: float
    displacement: np.ndarray
    force: float
    seconds: float


def write_truth(file: Path, found: dict[str, Sequence[dict[str, np.ndarray]]], seed: int) -> None:
    """Write contacts of the reference tier to a file; seed : of the random contacts
    found : sensor -> contacts, each with number, share, displacement (n, 3) m, force N, seconds"""
    arrays = {"seed": np.int64(seed)}
    for sensor, contacts in found.items():
        for name in ("number", "share", "force", "seconds"):
            arrays[f"{sensor}_{name}"] = np.array([each[name] for each in contacts])
        arrays[f"{sensor}_displacement"] = quantise(np.array([each["displacement"] for each in contacts]))
    with atomic.new_file(file) as partial, open(partial, "wb") as content:
        np.savez_compressed(content, **arrays)


def read_truth(file: Path, sensor: str) -> list[Truth]:
    """Read the reference tier's contacts on one sensor from a file that ``write_truth`` wrote."""
    with np.load(file, allow_pickle=False) as arrays:
        columns = {name: arrays[f"{sensor}_{name}"] for name in ("number", "share", "displacement", "force", "seconds")}
        contacts = list(random_contacts(int(columns["number"].max()) + 1, int(arrays["seed"])))
    return [
        Truth(int(number), contacts[number], float(share), moved * SCALE, float(force), float(seconds))
        for number, share, moved, force, seconds in zip(*columns.values(), strict=True)
    ]
