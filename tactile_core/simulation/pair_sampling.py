"""Solve the contacts of one press on both sensors, as rows of a file of pairs."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..geometry.indenters import Indenter
from ..mechanics.electrodes.biotac_sheet import signal_of
from ..mechanics.force_search import UnreachableError
from ..mechanics.penetration import PenetrationError
from ..mechanics.placement import Placement, depth_at, on_gel, pose_at
from ..mechanics.solution import Sensor, Solution, Step
from ..mechanics.solve import solve_path
from ..sensors import PAIR, SOURCE, TARGET, unrolling
from .pairs_file import quantise
from .random_bodies import random_body
from .scene import PairSpec, Scene

_SLIDE_FROM, _SLIDE_TO = 2, 10  # index of the force at which a slide begins: from the first, below the second (assumed)
_SLIDE_STEPS = 3  # contacts of a slide: sticking, partly slipping, wholly slipping (assumed)


def press_rows(
    scene: Scene, seed: int, press: int, pair: tuple[str, str] = PAIR, keep: Sequence[str] = ()
) -> list[dict[str, np.ndarray]]:
    """Return the contacts of a press, each a ``pair_row`` with the press's number, place, slide and indenter added.
    Force grows by the scene's ratio until a sensor reaches its greatest depth, or no contact is found. The first force
    is log-uniform within one ratio, so that forces are log-uniform over many presses. A press that slides ends with the
    slide, at constant force along the same path on both sensors. In a scene with ``depth_steps`` contacts have equal
    depth on both sensors instead of equal force.
    seed, press : numbers that decide the draw; pair : the sensors, source and target
    keep : ``("traction",)`` adds the tractions (n, 3) Pa on both surfaces"""
    spec = paired(scene)
    random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(press,)))
    which, indenter = _draw_body(random, scene, spec)
    place = draw_place(random, spec, pair[1])
    rows: list[dict[str, np.ndarray]] = []
    stood = np.array(dataclasses.astuple(place), np.float32)
    steps = _steps_of_depth(random, spec) if spec.depth_steps else _steps_of_force(random, spec)
    for step, biotac, digit in _on_both(indenter, place, spec, steps, pair):
        named: dict[str, np.ndarray] = {
            "press": np.array(press, np.int32),
            "indenter": np.array(which, np.int16),
            "slide": np.array(step.slide, np.float32),
            "place": stood,
        }
        rows.append({**named, **pair_row(biotac, digit, pair, keep)})
    return rows


def _draw_body(random: np.random.Generator, scene: Scene, spec: PairSpec) -> tuple[int, Indenter]:
    """Draw a press's body; return its index and it: one of the scene's, or (the index after them) a random one."""
    which = int(random.integers(len(scene.indenters)))
    if spec.random_bodies and random.uniform() < spec.random_bodies:
        return len(scene.indenters), random_body(random)
    return which, scene.indenters[which].build()


def _on_both(
    indenter: Indenter, place: Placement, spec: PairSpec, steps: Iterator[Step], pair: tuple[str, str]
) -> Iterator[tuple[Step, Solution, Solution]]:
    """Yield each step's contacts on both sensors of the pair, up to the greatest depth or until an edge penetrates."""
    steps, *for_each = itertools.tee(steps, 3)
    on_source, on_target = (
        _press(sensor, indenter, place, spec, own) for sensor, own in zip(pair, for_each, strict=True)
    )
    try:
        for step, source, target in zip(steps, on_source, on_target, strict=False):
            if not all(found.converged and found.contact_patch.any() for found in (source, target)):
                return
            yield step, source, target
    except (UnreachableError, PenetrationError):
        return


def _press(
    sensor: Sensor, indenter: Indenter, place: Placement, spec: PairSpec, steps: Iterable[Step]
) -> Iterator[Solution]:
    pose = pose_at(sensor, indenter, place)
    limit = depth_at(spec.depth_max_percent / 100, sensor, indenter, pose)
    return solve_path(sensor, indenter, pose, steps, friction=spec.friction, limit=limit)


def _steps_of_depth(random: np.random.Generator, spec: PairSpec) -> Iterator[Step]:
    """Yield evenly spaced depths from a random start."""
    least, most, start = 1e-3 * spec.depth_min_mm, 1e-3 * spec.depth_max_mm, random.uniform()
    for step in range(spec.depth_steps):
        yield Step(depth=least + (most - least) * (step + start) / spec.depth_steps)


def _steps_of_force(random: np.random.Generator, spec: PairSpec) -> Iterator[Step]:
    """Yield growing forces, without end unless the press slides."""
    force = spec.force_min_n * spec.force_ratio ** random.uniform()
    begin = int(random.integers(_SLIDE_FROM, _SLIDE_TO)) if random.uniform() < spec.slide_share else None
    heading, length = random.uniform(0, 2 * np.pi), 1e-3 * spec.slide_max_mm * random.uniform()
    for step in itertools.count():
        yield Step(force=force)
        if step == begin:
            break
        force *= spec.force_ratio
    for share in np.arange(1, _SLIDE_STEPS + 1) / _SLIDE_STEPS:
        slide = share * length * np.array([np.cos(heading), np.sin(heading)])
        yield Step(force=force, slide=tuple(slide))


def paired(scene: Scene) -> PairSpec:
    """Return the scene's distribution of presses. Raises TactileError for a scene without pairs."""
    if scene.pairs is None:
        raise TactileError("scene, pairs", "none", "a table [pairs]")
    return scene.pairs


def draw_place(random: np.random.Generator, spec: PairSpec, target: str = TARGET) -> Placement:
    """Draw the place and tilt of a press: uniform over the target's gel without its rim, the tilt uniform in the cone
    of ``spec`` round the normal."""
    shape = sensors.shape_of(target)
    while True:
        x = random.uniform(shape.tip_x, shape.base_x)
        z = random.uniform(-shape.half_width, shape.half_width)
        if on_gel(x, z, spec.rim_margin_mm * 1e-3, target) and on_gel(x, z):  # the pad knows what the DIGIT covers
            break
    lean = np.arccos(random.uniform(np.cos(np.radians(spec.tilt_max_deg)), 1))
    return Placement(x, z, float(lean), float(random.uniform(0, 2 * np.pi)))


def pair_row(
    biotac: Solution, digit: Solution, pair: tuple[str, str] = PAIR, keep: Sequence[str] = ()
) -> dict[str, np.ndarray]:
    """Return what a file stores of one contact on both sensors of ``pair``, by the names of ``pairs_writer.units``.
    biotac, digit : solutions on source and target; keep : ``("traction",)`` adds the tractions on both surfaces"""
    source, target = pair
    both = (source, biotac), (target, digit)
    return {
        **{f"{word}_{name}": getattr(found, word).astype(np.float32) for word in keep for name, found in both},
        f"displacement_{source}": quantise(biotac.displacement),
        f"displacement_{target}": quantise(digit.displacement),
        "signal": signal_of(biotac, source).astype(np.float32),
        "gap": biotac.electrode_gaps.astype(np.float32),
        "force": biotac.force.astype(np.float32),
        f"force_{target}": digit.force.astype(np.float32),
        "pressure": np.float32(biotac.pressure),
        f"depth_{source}": np.float32(biotac.depth),
        f"depth_{target}": np.float32(digit.depth),
        "contact_center": digit.centre.astype(np.float32),
        f"beyond_{target}": beyond_gel(biotac.contact_patch, target, source),
        f"contact_patch_{source}": biotac.contact_patch,
        f"contact_patch_{target}": digit.contact_patch,
    }


def beyond_gel(touched: np.ndarray, target: str = TARGET, source: str = SOURCE) -> np.bool_:
    """Return true if a contact, source nodes touched (n,) bool, reaches beyond what unrolls onto the target's gel."""
    x, z = unrolling.unrolled_nodes(source)[touched].T
    return (sensors.shape_of(target).outline_distance(x, z) <= 0).any()  # it is 0 everywhere outside
