"""Hold contact mechanics against known answers, and its fast tier against its reference tier.

    python scripts/validate_mechanics.py                       every row, docs/mechanics.md (20 minutes)
    python scripts/validate_mechanics.py --quick --json FILE   a short run, writes FILE alone (about five minutes)

Prints a table; exits 1 when an error row misses its target. Needs the extra [fem].
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core import atomic, metrics
from tactile_core.indenters import Sphere, pose_on
from tactile_core.mechanics.bonded_layer import (
    GOLDEN_BALL,
    GOLDEN_FORCE,
    GOLDEN_RADIUS,
    GOLDEN_THICKNESS,
    quarter_disc,
)
from tactile_core.mechanics.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.newton import FiniteStrainContact
from tactile_core.mechanics.press import Placement
from tactile_core.mechanics.solve import solve, solve_path
from tactile_core.sensors import Material

REPORT = Path(__file__).resolve().parent.parent / "docs" / "mechanics.md"
BALL, PLACE = Sphere(3.5e-3), Placement(-8e-3, 2e-3, 0.1, 1.0)
# name of the disc's mesh -> node intervals in the even part and outside, its side in m, layers
DISCS = {
    "coarse": ((12, 6), 4.2e-3, [0, 0.25, 0.5, 0.7, 0.85, 0.925, 1]),
    "fine": ((20, 8), 4.0e-3, [0, 0.2, 0.4, 0.575, 0.75, 0.825, 0.9, 0.95, 1]),
}
# Golden forces within 0.5 %, shape 5 um rms up to 20 % depth (issue MECHANICS). The fast tier's force has no target:
# the correction that is to bring it to 5 % does not exist yet.
GOLDEN_TARGET, SHAPE_TARGET = 0.5, 5.0

Row = dict[str, Any]


def main() -> int:
    """Run, print, write; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="coarse disc, one depth a sensor")
    parser.add_argument("--json", metavar="FILE", help="write the rows here")
    options = parser.parse_args()
    rows: list[Row] = []
    for found in measure(options.quick):
        rows.append(found)
        print(line(found), flush=True)
    if options.json:
        atomic.write_json(Path(options.json), rows)
    if not options.quick:
        with atomic.new_file(REPORT) as partial:
            partial.write_text(report(rows), encoding="utf-8")
    return int(any(row["ok"] is False for row in rows))


def measure(quick: bool) -> Iterator[Row]:
    """All rows, as they come."""
    yield from golden("coarse" if quick else "fine", [0.6e-3] if quick else [0.2e-3, 0.6e-3, 1.0e-3, 1.4e-3])
    yield from tiers("digit", [0.2e-3] if quick else [0.2e-3, 0.4e-3, 0.6e-3, 0.8e-3, 1.2e-3])
    yield from tiers("biotac", [0.3e-3] if quick else [0.3e-3, 0.6e-3, 0.9e-3, 1.2e-3])


def golden(mesh: str, depths: list[float]) -> Iterator[Row]:
    """The finite-strain solver on the disc of ``mechanics.md``."""
    intervals, fine, layers = DISCS[mesh]
    solid_mesh, fixed = quarter_disc(GOLDEN_RADIUS, GOLDEN_THICKNESS, fine, intervals, np.array(layers))
    ball = Sphere(GOLDEN_BALL)
    pose = pose_on(ball, np.array([0, -GOLDEN_THICKNESS, 0]), np.array([0, -1.0, 0]))
    near = np.hypot(*solid_mesh.nodes[solid_mesh.surface][:, [0, 2]].T) < fine
    solid = FiniteStrainSolid(solid_mesh, Material(1e6, 0.49))
    contact = FiniteStrainContact(solid, solid_mesh.surface[near], ball, pose, fixed=fixed)
    touch = None
    for depth in depths:
        started = time.perf_counter()
        touch = contact.press(depth, touch, step=0.2e-3)
        error = 100 * abs(4 * touch.force[1] / GOLDEN_FORCE[depth] - 1)
        name = f"golden_force_{depth * 1e3:.1f}mm"
        yield row(f"{name}_error", error, "percent", GOLDEN_TARGET if mesh == "fine" else None, 100.0, mesh)
        yield row(f"{name}_time", time.perf_counter() - started, "s", None, None, mesh)


def tiers(sensor: str, depths: list[float]) -> Iterator[Row]:
    """The fast tier against the reference tier on one sensor, along one press of growing depth."""
    started = time.perf_counter()
    for exact in solve_path(sensor, BALL, PLACE, depths, "reference"):
        depth, middle = exact.depth, time.perf_counter()
        fast = solve(sensor, BALL, PLACE, depth=depth)
        ended = time.perf_counter()
        where = f"{sensor}_fast_{depth * 1e3:.1f}mm"
        error, null = (
            1e6 * float(metrics.rms_in_contact(found[None], exact.displacement[None])[0])
            for found in (fast.displacement, np.zeros_like(exact.displacement))
        )
        largest = 1e6 * float(metrics.max_error(fast.displacement[None], exact.displacement[None])[0])
        load = np.linalg.norm(exact.force)
        shallow = sensor == "digit" and depth <= 0.2 * 4.06e-3
        yield row(f"{where}_shape_rms", error, "um", SHAPE_TARGET if shallow else None, null, "7 mm ball, one place")
        yield row(f"{where}_shape_max", largest, "um", None, None, "7 mm ball, one place")
        off = 100 * (np.linalg.norm(fast.force) / load - 1)
        yield row(f"{where}_force_error", float(off), "percent", None, -100.0, "7 mm ball, one place")
        yield row(f"{where}_time", 1e3 * (ended - middle), "ms", None, None, "with set-up")
        yield row(f"{sensor}_reference_{depth * 1e3:.1f}mm_time", middle - started, "s", None, None, "this step")
        started = time.perf_counter()


def row(name: str, value: float, unit: str, target: float | None, null: float | None, of: str) -> Row:
    """One figure; ``ok`` is None where there is no target."""
    value = float(f"{value:.4g}")
    null = None if null is None else float(f"{null:.4g}")
    ok = None if target is None else bool(abs(value) <= target)
    return {"name": name, "value": value, "unit": unit, "target": target, "ok": ok, "null": null, "set": of}


def line(found: Row) -> str:
    """A row as a line of the table."""
    mark = {None: "", True: "ok", False: "MISSED"}[found["ok"]]
    cells = [found["name"], found["value"], found["unit"], found["target"], found["null"], found["set"], mark]
    return "| " + " | ".join("" if cell is None else str(cell) for cell in cells) + " |"


def report(rows: list[Row]) -> str:
    """``docs/mechanics.md``."""
    head = (
        "# Contact mechanics against known answers\n\n"
        "Made by `python scripts/validate_mechanics.py`. *fast* is the linear tier on the surface compliance,\n"
        "*reference* the finite-strain tier on the same mesh; shape errors are over surface nodes that move more than\n"
        "10 um. `null` is the answer of doing nothing. Times are from one shared 2-core machine.\n\n"
        "| name | value | unit | target | null | set | |\n|---|---|---|---|---|---|---|\n"
    )
    return head + "\n".join(line(found) for found in rows) + "\n"


if __name__ == "__main__":
    sys.exit(main())
