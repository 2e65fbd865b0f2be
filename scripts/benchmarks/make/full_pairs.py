"""Solve a press of the test set: contacts at the same force on both sensors, by the full tier of mechanics.

The rows are like those of ``pair_sampling``. But the full tier needs no correction, and the fluid film over the
electrodes is computed from its own deformed inner skin. Press i draws all it needs from (seed, i).
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator

import numpy as np

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Box, Indenter, Ring
from tactile_core.mechanics.force_search import UnreachableError
from tactile_core.mechanics.penetration import PenetrationError
from tactile_core.mechanics.placement import DEPTH_LIMIT, Placement, depth_at, pose_at, surface_drop
from tactile_core.mechanics.solution import Solution, Step
from tactile_core.mechanics.solve import solve, solve_path
from tactile_core.sensors import SOURCE, TARGET
from tactile_core.simulation.pair_sampling import draw_place, pair_row, paired
from tactile_core.simulation.scene import Scene

REGION_X = -14e-3  # m: the region of the pad toward the tip, x below this, that a network may be kept from seeing
SHARES = 0.25, 0.55, 1.0  # of a press's greatest depth on the BioTac, at which it is sampled
_SHALLOWEST, _DEEPEST = 0.3e-3, 1.5e-3  # m, a press's greatest depth on the BioTac, uniform between (assumed)
_SLIDE_MOST = 1e-3  # m, likewise of slides (assumed)
_SLIDING = 4, 11  # numbers, of twelve presses, that end with a slide: one on the whole gel, one in the region
# Numbers, of eight presses, of the box's and the ring's, one in the region each; other bodies take turns in the rest.
_BOX, _RING, _OTHERS = (0, 5), (2, 7), (1, 3, 4, 6)
_TRIES = 12  # reductions by a fifth to a depth that both sensors bear: to a fourteenth


@dataclasses.dataclass(frozen=True)
class TestPress:
    """Press ``number`` of the test set. which : index of the scene's indenter; depth : m, greatest, on the BioTac
    slide : (2,) m, along and across the finger, from the greatest depth on; None for none"""

    __test__ = False  # not a test, whatever pytest takes its name for

    number: int
    which: int
    indenter: Indenter
    place: Placement
    depth: float
    slide: np.ndarray | None


Pair = tuple[np.ndarray, Solution, Solution]  # slide (2,) m, and both sensors' contacts


def draw_press(scene: Scene, seed: int, number: int) -> TestPress:
    """Draw press ``number`` from ``seed``; one with an odd number has x below ``REGION_X``. Raises TactileError unless
    the scene has a box, a ring and other bodies."""
    random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    which = _turn(scene, number)
    indenter = scene.indenters[which].build()
    while True:
        place = draw_place(random, paired(scene))
        if number % 2 == 0 or place.x < REGION_X:
            break
    drawn = random.uniform(_SHALLOWEST, _DEEPEST)
    heading, length = random.uniform(0, 2 * np.pi), random.uniform(0, _SLIDE_MOST)
    slide = length * np.array([np.cos(heading), np.sin(heading)]) if number % 12 in _SLIDING else None
    thick = depth_at(DEPTH_LIMIT, SOURCE, indenter, pose_at(SOURCE, indenter, place))
    depth = _borne(indenter, place, min(drawn, thick), paired(scene).friction)
    return TestPress(number, which, indenter, place, depth, slide)


def _borne(indenter: Indenter, place: Placement, depth: float, friction: float) -> float:
    """Return ``depth``, m, on the BioTac, reduced by fifths until the fast tier solves a contact of the same force on
    the DIGIT too. friction : Coulomb's coefficient"""
    for _ in range(_TRIES):
        try:
            force = solve(SOURCE, indenter, place, depth=depth, friction=friction).axial_force
            if force > 0:
                solve(TARGET, indenter, place, force=force, friction=friction)
            break
        except (UnreachableError, PenetrationError):
            depth *= 0.8  # where an edge sinks in between nodes the full tier does not follow either
    return depth


def _turn(scene: Scene, number: int) -> int:
    """Return the index of the indenter whose turn it is, so that all come about equally often. Raises TactileError."""
    built = [spec.build() for spec in scene.indenters]
    boxes, rings = ([i for i, one in enumerate(built) if isinstance(one, kind)] for kind in (Box, Ring))
    others = [i for i in range(len(built)) if i not in boxes + rings]
    if scene.pairs is None or len(boxes) != 1 or len(rings) != 1 or not others:
        found = f"{len(boxes)} boxes, {len(rings)} rings, {len(others)} others"
        raise TactileError("test set, scene", found, "[pairs], one box, one ring and other indenters")
    cycle, turn = divmod(number, 8)
    if turn in _BOX:
        return boxes[0]
    return rings[0] if turn in _RING else others[(len(_OTHERS) * cycle + _OTHERS.index(turn)) % len(others)]


def full_rows(scene: Scene, press: TestPress) -> tuple[list[dict[str, np.ndarray]], dict[str, np.ndarray]]:
    """Solve a press; return the arrays of each contact by name, as in a file of pairs, and a record of scalars.

    The record: wanted, number of contacts; lost, text on why the last ones are missing, or empty; seconds of CPU.
    """
    began = time.process_time()
    rows: list[dict[str, np.ndarray]] = []
    steps = [(share * press.depth, np.zeros(2)) for share in SHARES]
    if press.slide is not None:
        steps.append((press.depth, press.slide))
    named: dict[str, np.ndarray] = {
        "press": np.array(press.number, np.int32),
        "indenter": np.array(press.which, np.int16),
        "place": np.array(dataclasses.astuple(press.place), np.float32),
    }
    lost = ""
    try:
        for slide, biotac, digit in _pairs(press, steps, paired(scene).friction):
            rows.append({**named, "slide": slide.astype(np.float32), **pair_row(biotac, digit)})
    except TactileError as error:
        lost = str(error)
    took = np.array(time.process_time() - began)
    return rows, {"wanted": np.array(len(steps), np.int32), "lost": np.array(lost), "seconds": took}


def _pairs(press: TestPress, steps: list[tuple[float, np.ndarray]], friction: float) -> Iterator[Pair]:
    """Yield slide and both sensors' contacts of each step. Raises TactileError at a step that is not found on one.
    steps : pairs of depth m and slide (2,) m; friction : Coulomb's coefficient"""
    on_biotac, trouble = _on_biotac(press, steps, friction)
    if on_biotac:
        slides = [slide for _, slide in steps[: len(on_biotac)]]
        pose = pose_at(TARGET, press.indenter, press.place)
        limit = depth_at(DEPTH_LIMIT, TARGET, press.indenter, pose)
        asked = [Step(force=found.axial_force, slide=tuple(to)) for to, found in zip(slides, on_biotac, strict=True)]
        on_digit = solve_path(TARGET, press.indenter, pose, asked, "full", friction, limit)
        yield from zip(slides, on_biotac, on_digit, strict=True)
    if trouble:
        raise trouble


def _on_biotac(
    press: TestPress, steps: list[tuple[float, np.ndarray]], friction: float
) -> tuple[list[Solution], TactileError | None]:
    """Return the contacts found on the BioTac, and the error that ended them or None. While it slides, the indenter
    keeps its depth under the surface. steps : pairs of depth m and slide (2,) m; friction : Coulomb's coefficient"""
    pose, surface, found = pose_at(SOURCE, press.indenter, press.place), sensors.biotac_surface(), []
    drops = [surface_drop(surface, press.indenter, pose, pose.slid(*slide)) for _, slide in steps]
    asked = [Step(max(depth + drop, 0.0), slide=tuple(to)) for (depth, to), drop in zip(steps, drops, strict=True)]
    try:
        for contact in solve_path(SOURCE, press.indenter, pose, asked, "full", friction):
            if contact.axial_force <= 0:
                raise TactileError("full tier, biotac", "no force", "a contact")
            found.append(contact)
    except TactileError as error:
        return found, error
    return found, None
