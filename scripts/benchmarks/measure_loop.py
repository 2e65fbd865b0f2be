"""Measure what a simulator's loop asks for: contacts, alone and along paths, pictures, whole steps of a ``Gel``.

    python scripts/benchmarks/measure_loop.py               docs/in_the_loop.md's table
    python scripts/benchmarks/measure_loop.py --count 18    a quick look

Random contacts of nine indenters on each sensor, with friction. Alone: each is solved without one before. On a path:
the same depth is reached in ten steps, the first untimed. Step and picture: a ``Gel`` of the DIGIT goes down in five
steps, then slides along the finger in five of 0.1 mm. Meshes: four bodies by formula and, at the same places and
depths, as meshes of up to 82,000 triangles, each contact alone; and how long a mesh takes to load. Prints quantiles,
50, 95 and 99 %, of CPU and wall ms per contact on one core, code compiled before; beside them the fast tier's error
against the full tier (`mechanics_tiers.json`). Needs the extra [fem].
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
import unittest.mock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import parser_of
from benchmarks.mechanics.random_contacts import RandomContact, random_contacts
from tactile_core.errors import TactileError
from tactile_core.files import compiled, threads
from tactile_core.geometry.indenters import Box, Cylinder, Indenter, MeshIndenter, Sphere
from tactile_core.jobs.gel import Gel
from tactile_core.mechanics.error_estimate import measured
from tactile_core.mechanics.fast.active_set import UnsolvedError
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.press import CorrectedPress, FastContact
from tactile_core.mechanics.placement import DEPTH_LIMIT, FRICTION, pose_at, thickness_under
from tactile_core.pictures.height_map import folds_counted, gel_mapper
from tactile_core.pictures.renderer import Renderer

STEPS, SEED = 10, 20261125
SLIDE = 0.1e-3  # m per step
LEVELS, LEVELS_SHOWN = (0.5, 0.95, 0.99), "median | 95 % | 99 %"
WARM = 9  # contacts before the first that counts, one of each indenter
Times = list[tuple[float, float]]  # CPU and wall, ms


def main(arguments: list[str] | None = None) -> int:
    """Measure and print the table; returns the exit status."""
    parser = parser_of(__doc__, json=False)
    parser.add_argument("--count", type=int, default=500, help="contacts a sensor, alone and on paths (%(default)s)")
    options = parser.parse_args(arguments)
    if not compiled.available():
        print("measure_loop: numba is not installed (extra [fem]), or switched off", file=sys.stderr)
        return 2
    threads.one_thread()  # the times are those of one core
    os.environ.setdefault(compiled.SWITCH, "1")  # loops at their first call: what is timed is warm
    print(f"| | CPU ms: {LEVELS_SHOWN} | wall ms: {LEVELS_SHOWN} | error |\n|---|---|---|---|---|---|---|---|")
    for name, times, error in all_measured(options.count):
        print(f"| {name} | {' | '.join(f'{each:.3g}' for each in quantiles(times))} | {error} |", flush=True)
    return 0


def quantiles(times: Times) -> list[float]:
    """Return the median, 95 % and 99 % quantile of CPU ms, then the same three of wall ms."""
    return [float(np.quantile(each, level)) for each in np.array(times).T for level in LEVELS]


def all_measured(count: int) -> Iterator[tuple[str, Times, str]]:
    """Yield name, times and a text on the error of each thing that is measured; count : contacts per sensor"""
    for sensor in ("digit", "biotac"):
        tier = measured()["tiers"]["fast"][sensor]["bins"][1]
        stated = f"{tier['shape_um']:.2g} um, {100 * tier['force']:.2g} % of force from the full tier"
        for name, steps, contacts in (("alone", 1, count), ("on a path", STEPS, -(-count // STEPS))):
            times, last = measure(sensor, steps, contacts)
            settled = [each for each in last if each is not None]
            yield f"{sensor}, {name}", times, f"{stated}; {len(settled) / len(last):.1%} of paths settled"
            if sensor == "digit" and steps > 1:
                yield from pictures(settled)
    yield "digit, step and picture", gel_steps(count), "see above"
    yield from meshes(count)


def measure(sensor: str, steps: int, count: int) -> tuple[Times, list[FastContact | None]]:
    """Time ``count`` random contacts, each reached in ``steps`` even steps of depth; of several the first is untimed.
    Return the steps' times, and the contacts at the last steps, None for one not found. WARM more contacts come first;
    they are returned, but not timed."""
    times: Times = []
    last = []
    for number, contact in enumerate(random_contacts(count + WARM, SEED)):
        pose = pose_at(sensor, contact.indenter, contact.place)
        thick = thickness_under(sensor, contact.indenter, pose)
        press = CorrectedPress(compliance_of(sensor), contact.indenter, pose, DEPTH_LIMIT * thick, FRICTION)
        for step in range(1, steps + 1):
            took, solved = timed(lambda p=press, d=contact.depth * thick * step / steps: at_depth(p, d))
            if number >= WARM and (step > 1 or steps == 1):
                times.append(took)
        last.append(solved)
    return times, last


def meshes(count: int) -> Iterator[tuple[str, Times, str]]:
    """Yield name, times and a remark: of loading four meshes, of ``count`` contacts of the DIGIT with these bodies by
    formula, and of the same contacts with the meshes, whose remark is the difference of force."""
    import trimesh

    made = trimesh.creation
    bodies: list[tuple[Indenter, Any]] = [
        (Sphere(3e-3), made.icosphere(5, 3e-3)),
        (Sphere(12e-3), made.icosphere(6, 12e-3)),
        (Cylinder(1.5e-3, 0.1e-3), made.cylinder(1.5e-3, 10e-3, sections=128)),
        (Box((8e-3,) * 3, 0.1e-3), made.box((8e-3,) * 3)),
    ]
    compliance_of("digit")
    loads: Times = []
    pairs: list[tuple[Indenter, MeshIndenter]] = []
    with tempfile.TemporaryDirectory() as folder, unittest.mock.patch.dict(os.environ, TACTILE_CACHE=folder):
        MeshIndenter.from_trimesh(made.box((2e-3,) * 3))  # compiles the loops
        for formula, mesh in bodies:
            mesh.apply_translation([0, 0, -mesh.bounds[0, 2]])
            took, loaded = timed(lambda m=mesh: MeshIndenter.from_trimesh(m))
            loads.append(took)
            pairs.append((formula, loaded))
    off = f"within {1e6 * max(mesh.error[0] for _, mesh in pairs):.2g} um rms of the mesh"
    yield "digit, a mesh is loaded", loads, off
    times: tuple[Times, Times] = ([], [])
    apart = []
    for number, contact in enumerate(random_contacts(count + WARM, SEED)):
        forces = []
        for taken, indenter in zip(times, pairs[number % len(pairs)], strict=True):
            try:
                pose = pose_at("digit", indenter, contact.place)
            except TactileError:  # another body than the place was drawn for may pass the sensor by
                break
            thick = thickness_under("digit", indenter, pose)
            press = CorrectedPress(compliance_of("digit"), indenter, pose, DEPTH_LIMIT * thick, FRICTION)
            took, solved = timed(lambda p=press, d=contact.depth * thick: at_depth(p, d))
            if number >= WARM:
                taken.append(took)
            forces.append(np.nan if solved is None else solved.axial_force)
        if len(forces) == 2 and forces[0]:  # a light touch may fall between the surface's nodes
            apart.append(abs(forces[1] / forces[0] - 1))
    yield "digit, alone, four bodies by formula", times[0], "see alone"
    yield "digit, alone, as meshes", times[1], f"{np.nanmedian(apart):.2%} of force from the formula (median)"


def pictures(contacts: list[FastContact]) -> Iterator[tuple[str, Times, str]]:
    """Yield name, times and a text on the error of the contacts' height maps, then of their fast pictures."""
    renderer = Renderer(preset="fast")
    mapper = gel_mapper(renderer.camera)
    heights: Times = []
    shading: Times = []
    for contact in contacts:
        with folds_counted():
            took, height = timed(lambda c=contact: mapper(c.corrected.displacement))
        heights.append(took)
        shading.append(timed(lambda h=height: renderer(h))[0])
    yield "digit, height map", heights, "0.1 um"
    yield "digit, fast picture", shading, "see optics.md"


def gel_steps(count: int) -> Times:
    """Return the times of ``count`` steps of a ``Gel`` with their pictures, along paths (``pressed_and_slid``)."""
    times: Times = []
    for number, contact in enumerate(random_contacts(-(-count // STEPS) + WARM, SEED)):
        gel = Gel("digit", contact.indenter)
        for step, pose in enumerate(pressed_and_slid(contact)):
            took, _ = timed(lambda g=gel, p=pose: (g.press(p), g.picture()))
            if number >= WARM and step:
                times.append(took)
    return times


def pressed_and_slid(contact: RandomContact) -> list[np.ndarray]:
    """List 11 poses (4, 4) on the DIGIT: first touch, five depths to the contact's own, five slides toward the base."""
    pose = pose_at("digit", contact.indenter, contact.place)
    deepest = contact.depth * thickness_under("digit", contact.indenter, pose)
    half = STEPS // 2
    poses = []
    for step in range(STEPS + 1):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = pose.axes, pose.moved(deepest * min(step / half, 1)).apex
        matrix[0, 3] += SLIDE * max(step - half, 0)
        poses.append(matrix)
    return poses


def at_depth(press: CorrectedPress, depth: float) -> FastContact | None:
    """Return the contact at a depth, m; None if none is found: the time to find that counts too."""
    try:
        found = press.at_depth(depth)
    except (TactileError, UnsolvedError):
        return None
    return found if found.linear.converged else None


def timed(work: Callable[[], Any]) -> tuple[tuple[float, float], Any]:
    """Call ``work``; return the (CPU ms, wall ms) that it took, and its result."""
    wall, cpu = time.perf_counter(), time.process_time()
    found = work()
    return (1e3 * (time.process_time() - cpu), 1e3 * (time.perf_counter() - wall)), found


if __name__ == "__main__":
    sys.exit(main())
