"""The contacts of one press on both sensors, as rows of a file of pairs."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Iterator

import numpy as np

from ..geometry.indenters import Indenter
from ..mechanics.electrodes.law import SHEET, signal_of
from ..mechanics.force_search import UnreachableError
from ..mechanics.penetration import PenetrationError
from ..mechanics.placement import Placement, on_gel, pose_at
from ..mechanics.solve import Sensor, Solution, Step, solve_path
from ..mechanics.thickness import depth_at
from ..sensors import digit as digit_shape
from ..sensors import unrolling
from .pairs_file import quantise
from .scene import PairSpec, Scene

_SLIDE_FROM, _SLIDE_TO = 2, 10  # steps of a path's force at which a slide may begin (assumed)
_SLIDE_STEPS = 3  # contacts of a slide: sticking, partly and wholly slipping ones (assumed)


def press_rows(scene: Scene, seed: int, press: int, electrodes: str = SHEET) -> list[dict[str, np.ndarray]]:
    """The contacts of one press: force grows by the scene's ratio until the first sensor reaches its greatest depth.

    Forces begin log-uniformly within one ratio, so over many presses they are log-uniform. A press that slides ends
    with its slide, at the force it had reached, by the same way on both sensors. A scene with ``depth_steps`` pairs
    contacts of the same depth in place of those of the same force. electrodes : their law, of ``law.LAWS``
    """
    spec = scene.pairs
    random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(press,)))
    which = int(random.integers(len(scene.indenters)))
    indenter = scene.indenters[which].build()
    place = draw_place(random, spec)
    rows, stood = [], np.array(dataclasses.astuple(place), np.float32)
    steps = _steps_of_depth(random, spec) if spec.depth_steps else _steps_of_force(random, spec)
    for step, biotac, digit in _on_both(indenter, place, spec, steps):
        named = {
            "press": np.int32(press),
            "indenter": np.int16(which),
            "slide": np.array(step.slide, np.float32),
            "place": stood,
        }
        rows.append({**named, **pair_row(biotac, digit, electrodes)})
    return rows


def _on_both(
    indenter: Indenter, place: Placement, spec: PairSpec, steps: Iterator[Step]
) -> Iterator[tuple[Step, Solution, Solution]]:
    """Each step's contacts on both sensors, while both follow: to the greatest depth, or where an edge sinks in."""
    steps, for_biotac, for_digit = itertools.tee(steps, 3)
    on_biotac = _press("biotac", indenter, place, spec, for_biotac)
    on_digit = _press("digit", indenter, place, spec, for_digit)
    try:
        for step, *both in zip(steps, on_biotac, on_digit, strict=False):
            if not all(found.converged and found.contact_patch.any() for found in both):
                return
            yield step, *both
    except (UnreachableError, PenetrationError):
        return


def _press(
    sensor: Sensor, indenter: Indenter, place: Placement, spec: PairSpec, steps: Iterable[Step]
) -> Iterator[Solution]:
    pose = pose_at(sensor, indenter, place)
    limit = depth_at(spec.depth_max_percent / 100, sensor, indenter, pose)
    return solve_path(sensor, indenter, pose, steps, friction=spec.friction, limit=limit)


def _steps_of_depth(random: np.random.Generator, spec: PairSpec) -> Iterator[Step]:
    """Depths evenly apart, from a random start."""
    least, most, start = 1e-3 * spec.depth_min_mm, 1e-3 * spec.depth_max_mm, random.uniform()
    for step in range(spec.depth_steps):
        yield Step(depth=least + (most - least) * (step + start) / spec.depth_steps)


def _steps_of_force(random: np.random.Generator, spec: PairSpec) -> Iterator[Step]:
    """Growing forces, without an end unless the press slides."""
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


def draw_place(random: np.random.Generator, spec: PairSpec) -> Placement:
    """Draw the place and tilt of a press: evenly over the gel inside its rim, leaning evenly over directions."""
    while True:
        x = random.uniform(digit_shape.X_TIP, digit_shape.X_BASE)
        z = random.uniform(-digit_shape.HALF_WIDTH, digit_shape.HALF_WIDTH)
        if on_gel(x, z, spec.rim_margin_mm * 1e-3):
            break
    lean = np.arccos(random.uniform(np.cos(np.radians(spec.tilt_max_deg)), 1))
    return Placement(x, z, float(lean), float(random.uniform(0, 2 * np.pi)))


def pair_row(biotac: Solution, digit: Solution, electrodes: str = SHEET) -> dict[str, np.ndarray]:
    """Arrays stored of one paired contact, as in the file, see ``DATASETS``. Electrodes' films are not corrected."""
    return {
        "displacement_biotac": quantise(biotac.displacement),
        "displacement_digit": quantise(digit.displacement),
        "signal": signal_of(biotac, electrodes).astype(np.float32),
        "gap": biotac.electrode_gaps.astype(np.float32),
        "force": biotac.force.astype(np.float32),
        "force_digit": digit.force.astype(np.float32),
        "pressure": np.float32(biotac.pressure),
        "depth_biotac": np.float32(biotac.depth),
        "depth_digit": np.float32(digit.depth),
        "contact_center": digit.centre.astype(np.float32),
        "beyond_digit": beyond_digit(biotac.contact_patch),
        "contact_patch_biotac": biotac.contact_patch,
        "contact_patch_digit": digit.contact_patch,
    }


def beyond_digit(touched: np.ndarray) -> np.bool_:
    """Return true if these nodes (n,) bool of the BioTac reach beside what rolls onto the DIGIT's gel.

    No contact of the gel is their equal.
    """
    x, z = unrolling.unrolled_nodes()[touched].T
    return (digit_shape.outline_distance(x, z) <= 0).any()  # it is 0 everywhere outside
