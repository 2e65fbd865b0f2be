"""Make scenes/training/double_contacts.npz: contacts of two balls, 5 to 12 mm apart, on both sensors (fast tier).

    python scripts/benchmarks/make/make_double_contacts.py --out double_contacts.npz

Each ball lies at the same unrolled place and angle on both sensors, as deep as the same force takes it there alone;
then both are one body, pressed in along the mean of their directions. A few minutes of CPU.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from tactile_core.errors import TactileError
from tactile_core.files import atomic
from tactile_core.geometry.indenters import Pose, Several, Sphere
from tactile_core.mechanics.electrodes.biotac_sheet import signal_of
from tactile_core.mechanics.placement import Placement, first_touch, on_gel, pose_at
from tactile_core.mechanics.solution import Solution, Step
from tactile_core.mechanics.solve import solve, solve_path
from tactile_core.sensors import PAIR, sensor_surface
from tactile_core.simulation.pairs_file import SCALE, quantise

APART, RADII, FORCES, LEAN = (5e-3, 12e-3), (1.5e-3, 5e-3), (0.15, 2.0), 15.0  # m, m, N, degrees; all assumed
RATIO = 3.0  # of both forces, at most
STEPS = 4  # of the way in, for friction


def drawn(random: np.random.Generator) -> list[tuple[Sphere, Placement, float]]:
    """Draw two balls; return each one's shape, place, and the force, N, that would take it alone to its depth."""
    while True:
        places = random.uniform([-17e-3, -6e-3], [1e-3, 6e-3], (2, 2))
        forces = np.exp(random.uniform(*np.log(FORCES), 2))
        apart = np.linalg.norm(places[0] - places[1])
        inside = all(on_gel(*place, 1.5e-3) and on_gel(*place) for place in places)
        if inside and APART[0] < apart < APART[1] and forces.max() < RATIO * forces.min():
            break
    leans = np.radians(random.uniform(0, LEAN, 2)), random.uniform(0, 2 * np.pi, 2)
    tilted = [Placement(*place, *angles) for place, *angles in zip(places, *leans, strict=True)]
    radii = np.exp(random.uniform(*np.log(RADII), 2))
    return [
        (Sphere(float(radius)), place, float(force)) for radius, place, force in zip(radii, tilted, forces, strict=True)
    ]


def solved(sensor: str, balls: list[tuple[Sphere, Placement, float]]) -> Solution:
    """Press both balls into a sensor at once, each as deep as its force takes it alone; return the last contact."""
    ends = []
    for ball, place, force in balls:
        pose = pose_at(sensor, ball, place)
        ends.append(pose.moved(solve(sensor, ball, place, force=force).depth))
    direction = sum(end.direction for end in ends)
    direction = direction / np.linalg.norm(direction)
    side = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    side = side / np.linalg.norm(side)
    axes, radii = np.column_stack([side, np.cross(-direction, side), -direction]), [ball.radius for ball, *_ in balls]
    lowest = [end.apex + (end.axes[:, 2] - axes[:, 2]) * radius for end, radius in zip(ends, radii, strict=True)]
    front = max(lowest, key=lambda point: point @ direction)
    parts = tuple((Sphere(one), Pose(axes.T @ (at - front), np.eye(3))) for at, one in zip(lowest, radii, strict=True))
    body, last = Several(parts), Pose(front, axes)
    begin = first_touch(sensor_surface(sensor), body, last)
    whole = float((last.apex - begin.apex) @ direction)
    steps = [Step(depth=whole * share) for share in np.arange(1, STEPS + 1) / STEPS]
    return list(solve_path(sensor, body, begin, steps))[-1]


def main() -> int:
    """Draw and solve the double contacts and write their file; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, metavar="FILE")
    parser.add_argument("--count", type=int, default=100)
    options = parser.parse_args()
    rows: list[dict[str, np.ndarray]] = []
    random, target = np.random.default_rng(52), PAIR[1]
    while len(rows) < options.count:
        balls = drawn(random)
        try:
            skin, gel = (solved(sensor, balls) for sensor in PAIR)
        except TactileError as error:
            print(error, file=sys.stderr)
            continue
        if skin.converged and gel.converged:
            alone = np.array([force for *_, force in balls], np.float32)
            places = np.array([(place.x, place.z) for _, place, _ in balls], np.float32)
            rows.append({
                "signal": signal_of(skin).astype(np.float32), "force": skin.force.astype(np.float32), "alone": alone,
                "place": places, f"displacement_{target}": quantise(gel.displacement),
                f"force_{target}": gel.force.astype(np.float32),
            })  # fmt: skip
            print(len(rows), np.linalg.norm(skin.force), alone, flush=True)
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    with atomic.new_file(options.out) as path, path.open("wb") as file:
        np.savez_compressed(file, scale=SCALE, **columns)
    return 0


if __name__ == "__main__":
    sys.exit(main())
