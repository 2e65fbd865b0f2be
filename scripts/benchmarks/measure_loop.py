"""Measure contacts in a simulator's loop: alone and along paths, with and without the extra [fast], and their pictures.

    python scripts/benchmarks/measure_loop.py --count 500 --markdown FILE --json FILE   docs/in_the_loop.md's
    python scripts/benchmarks/measure_loop.py --count 18                                  a quick look

Random contacts of nine indenters on each sensor, with friction. Alone: each from nothing. On a path: ten depths to the
same goal, the first left out. A step and picture: what a simulator's loop asks of a ``Gel`` of the DIGIT, five depths
to the goal and five slides of 0.1 mm along the finger. Median, 95 and 99 % of CPU and wall ms a contact on one core,
warm; both ways of computing take turns by contact, so that a busy machine slows both. Beside them the error: of the
fast tier against the full one (`mechanics_tiers.json`), and how far what is compiled lies from numpy. Needs the extras
[fem] and [fast].
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

from benchmarks.measured_rows import finished, parser_of, printed  # noqa: E402
from tactile_core.files.threads import one_thread  # noqa: E402

one_thread()  # before numpy is imported: the times are those of one core

import numpy as np  # noqa: E402

from benchmarks.mechanics.random_contacts import RandomContact, random_contacts  # noqa: E402
from tactile_core.accuracy import Row, row  # noqa: E402
from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.files import atomic, compiled  # noqa: E402
from tactile_core.jobs.gel import Gel  # noqa: E402
from tactile_core.mechanics.error_estimate import measured  # noqa: E402
from tactile_core.mechanics.fast.active_set import UnsolvedError  # noqa: E402
from tactile_core.mechanics.fast.compliance import compliance_of  # noqa: E402
from tactile_core.mechanics.fast.press import CorrectedPress, FastContact  # noqa: E402
from tactile_core.mechanics.placement import FRICTION, pose_at  # noqa: E402
from tactile_core.mechanics.thickness import DEPTH_LIMIT, thickness_under  # noqa: E402
from tactile_core.pictures.height_map import folds_counted, gel_mapper  # noqa: E402
from tactile_core.pictures.renderer import Renderer  # noqa: E402

STEPS, SEED = 10, 20261125
SLIDE = 0.1e-3  # m a step
LEVELS = (0.5, 0.95, 0.99)
WARM = 9  # contacts before the first that counts, one of each indenter
HOW = ("numpy", "compiled")
Times = list[tuple[float, float]]  # CPU and wall, ms


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--count", type=int, default=500, help="contacts a sensor, alone and on paths (%(default)s)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the table here")
    options = parser.parse_args(arguments)
    if not compiled.available():
        print("measure_loop: the extra [fast] is not installed, or switched off", file=sys.stderr)
        return 2
    rows, table = (
        [],
        [
            "| | way | CPU ms: median | 95 % | 99 % | wall ms: median | 95 % | 99 % | error |",
            "|---|---|---|---|---|---|---|---|---|",
        ],
    )
    for name, times, error in all_measured(options.count):
        for how in HOW:
            middle = quantiles(times[how])
            table.append(f"| {name} | {how} | {' | '.join(f'{each:.3g}' for each in middle)} | {error[how]} |")
        rows += as_rows(name, times, error)
    printed(rows)
    print("\n".join(table))
    if options.markdown:
        atomic.write_bytes(options.markdown, ("\n".join(table) + "\n").encode())
    return finished(rows, options.json)


def quantiles(times: Times) -> list[float]:
    """Median, 95 and 99 % of CPU, then of wall ms."""
    return [float(np.quantile(each, level)) for each in np.array(times).T for level in LEVELS]


def as_rows(name: str, times: dict[str, Times], error: dict[str, str]) -> list[Row]:
    """Make six rows for each way of computing."""
    rows = []
    for how in HOW:
        key = f"loop_{name.replace(', ', '_').replace(' ', '_')}_{how}"
        of = f"{len(times[how])} contacts, one core; error {error[how]}"
        labels = [f"{kind}{level}" for kind in ("cpu", "wall") for level in ("", "_95", "_99")]
        for label, value in zip(labels, quantiles(times[how]), strict=True):
            rows.append(row(f"{key}_{label}", value, "ms", of=of))
    return rows


def all_measured(count: int):  # noqa: ANN201
    """Yield a name, times by way, and the error by way in words."""
    for sensor in ("digit", "biotac"):
        for name, times, error, last in of_sensor(sensor, count):
            yield name, times, error
            if sensor == "digit" and name.endswith("path"):
                yield from pictures(last)
    yield gel_steps(count)


def of_sensor(sensor: str, count: int):  # noqa: ANN201
    """Yield the same of a sensor's contacts alone and on paths, and the contacts at the paths' ends."""
    tier = measured()["tiers"]["fast"][sensor]["bins"][1]
    stated = f"{tier['shape_um']:.2g} um, {100 * tier['force']:.2g} % of force from the full tier"
    for name, steps, contacts in (("alone", 1, count), ("on a path", STEPS, -(-count // STEPS))):
        times, apart, last = measure(sensor, steps, contacts)
        error = {"numpy": stated, "compiled": f"{np.quantile(apart, 0.99):.2g} um from numpy in 99 of 100"}
        yield f"{sensor}, {name}", times, error, last


def measure(sensor: str, steps: int, count: int) -> tuple[dict[str, Times], list[float], list[FastContact]]:
    """Times by way of random contacts, how far both ways lie apart, um, and the contacts at the ends of their paths."""
    times: dict[str, Times] = {how: [] for how in HOW}
    apart, last = [], []
    for number, contact in enumerate(random_contacts(count + WARM, SEED)):
        pose = pose_at(sensor, contact.indenter, contact.place)
        thick = thickness_under(sensor, contact.indenter, pose)
        found: dict[str, list[FastContact | None]] = {}
        for how in HOW:
            switch(how)
            press = CorrectedPress(compliance_of(sensor), contact.indenter, pose, DEPTH_LIMIT * thick, FRICTION)
            found[how] = []
            for step in range(1, steps + 1):
                took, solved = timed(lambda p=press, d=contact.depth * thick * step / steps: at_depth(p, d))
                found[how].append(solved)
                if number >= WARM and (step > 1 or steps == 1):
                    times[how].append(took)
        for plain, fast in zip(*found.values(), strict=True):
            if plain and fast:
                apart.append(1e6 * np.abs(plain.corrected.displacement - fast.corrected.displacement).max())
        last += [each for each in found["compiled"][-1:] if each]
    return times, apart, last


def pictures(contacts: list[FastContact]):  # noqa: ANN201
    """Yield the height map's and the fast picture's times and how far the two ways lie apart."""
    renderer = Renderer(preset="fast")
    mapper = gel_mapper(renderer.camera)
    heights: dict[str, Times] = {how: [] for how in HOW}
    shading: dict[str, Times] = {how: [] for how in HOW}
    apart, levels = [], []
    for contact in contacts:
        maps, seen = [], []
        for how in HOW:
            switch(how)
            with folds_counted():
                took, height = timed(lambda c=contact: mapper(c.corrected.displacement))
            heights[how].append(took)
            took, picture = timed(lambda h=height: renderer(h))
            shading[how].append(took)
            maps.append(height)
            seen.append(picture.astype(int))
        apart.append(1e6 * np.abs(maps[0] - maps[1]).max())
        levels.append(np.abs(seen[0] - seen[1]).max())
    yield "digit, height map", heights, {"numpy": "0.1 um", "compiled": f"{max(apart):.2g} um from numpy"}
    yield "digit, fast picture", shading, {"numpy": "see optics.md", "compiled": f"{max(levels)} levels from numpy"}


def gel_steps(count: int) -> tuple[str, dict[str, Times], dict[str, str]]:
    """Time whole steps of a ``Gel`` along paths, with their pictures: name, times by way, error by way in words."""
    times: dict[str, Times] = {how: [] for how in HOW}
    levels = []
    for number, contact in enumerate(random_contacts(-(-count // STEPS) + WARM, SEED)):
        seen: dict[str, list[np.ndarray]] = {how: [] for how in HOW}
        for how in HOW:
            switch(how)
            gel = Gel("digit", contact.indenter)
            for step, pose in enumerate(pressed_and_slid(contact)):
                took, picture = timed(lambda g=gel, p=pose: (g.press(p), g.picture())[1])
                seen[how].append(picture.astype(int))
                if number >= WARM and step:
                    times[how].append(took)
        levels.append(np.abs(np.subtract(*seen.values())).max())
    error = f"{np.quantile(levels, 0.9):.0f} levels from numpy on 9 of 10 paths"
    return "digit, step and picture", times, {"numpy": "see above", "compiled": error}


def pressed_and_slid(contact: RandomContact) -> list[np.ndarray]:
    """Poses (4, 4) on the DIGIT: first touch, depths to the contact's own, and slides from there toward the base."""
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


def switch(how: str) -> None:
    """Compute by numpy alone, or compiled."""
    os.environ[compiled.SWITCH] = "1" if how == "compiled" else "0"
    compiled.available.cache_clear()


def at_depth(press: CorrectedPress, depth: float) -> FastContact | None:
    """The contact, or None where none is found; the time of that counts too."""
    try:
        found = press.at_depth(depth)
    except (TactileError, UnsolvedError):
        return None
    return found if found.linear.converged else None


def timed(work: Callable[[], Any]) -> tuple[tuple[float, float], Any]:
    """CPU and wall ms of a call, and what it gives."""
    wall, cpu = time.perf_counter(), time.process_time()
    found = work()
    return (1e3 * (time.process_time() - cpu), 1e3 * (time.perf_counter() - wall)), found


if __name__ == "__main__":
    sys.exit(main())
