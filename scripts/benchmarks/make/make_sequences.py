"""Make the test set of sequences: presses, rolls and slides at 100 Hz on both sensors, by the fast tier.

    python3 scripts/benchmarks/make/make_sequences.py [--out FILE] [--each 20] [--seed 3]

Each sequence is 40 frames with one of the training's nine indenters, anywhere on the gel, up to 30 degrees off the
normal. It rests, the force rises to 0.2 to 2 N, and for 20 frames the indenter stays (press), leans over by 20 degrees
and moves with it (roll), or slides by 1 to 4 mm with the training's friction (slide); the force falls, and it rests.
Contacts of presses and slides go on from the one before; a roll's are solved alone. A sequence that cannot be solved on
a sensor is drawn again. A few minutes on one core; the full tier would take 3 s per frame and sensor, 4 hours in all.
The fast tier, which also solved the training pairs, differs from it by 7 to 8 um in the median of the test contacts and
by 30 um in deep ones (docs/accuracy.md); results on this set do not show that error.
"""

from __future__ import annotations

import argparse
import io
import pathlib
import sys

import numpy as np

from tactile_core import accuracy, sensors
from tactile_core.errors import TactileError
from tactile_core.files import atomic
from tactile_core.mechanics.electrodes.biotac_sheet import signal_of
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solution import Solution, Step
from tactile_core.mechanics.solve import solve, solve_path
from tactile_core.simulation.pair_sampling import draw_place
from tactile_core.simulation.scene import Scene, load_scene

TRAINING = pathlib.Path(__file__).resolve().parents[3] / "scenes" / "training"
OUT = TRAINING / "test_sequences.npz"
SENSORS = ("biotac", "digit")
MOTIONS = ("press", "roll", "slide")
REST, RISE, HOLD, FALL, AFTER = 4, 8, 20, 6, 2  # frames
FORCES = 0.2, 2.0  # N, log-uniform
LEAN = np.radians(20)  # of a roll
ROLLED = 3e-3  # m, as far as a ball of 8.6 mm radius rolls by LEAN
SLIDES = 1e-3, 4e-3  # m, so 5 to 20 mm/s
Contact = tuple[Solution, Solution]


def main() -> int:
    """Draw sequences of contacts, solve them on both sensors, write the test set; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=OUT, help="the file to write (%(default)s)")
    parser.add_argument("--each", type=int, default=20, help="sequences of each motion (20)")
    parser.add_argument("--seed", type=int, default=3, help="of the draws (3; training has 0, the test contacts 1)")
    arguments = parser.parse_args()
    scene, _ = load_scene(TRAINING)
    rows = []
    for number in range(arguments.each * len(MOTIONS)):
        motion = MOTIONS[number % len(MOTIONS)]
        random = np.random.default_rng([arguments.seed, number])
        rows.append(sequence(scene, motion, random))
        print(f"{number + 1}: {motion}, {rows[-1]['force'].max():.2f} N", flush=True)
    content = io.BytesIO()
    arrays = {name: np.stack([row[name] for row in rows]) for name in rows[0]}  # (sequences, 40, ...)
    np.savez_compressed(content, motion=np.arange(len(rows)) % len(MOTIONS), **arrays)
    atomic.write_bytes(arguments.out, content.getvalue())
    return 0


def sequence(scene: Scene, motion: str, random: np.random.Generator) -> dict[str, np.ndarray]:
    """Draw and solve one sequence; return its arrays (40, ...) by name, see ``described``. It is drawn again if a
    contact cannot be solved or touches nothing. motion : one of ``MOTIONS``"""
    while True:
        indenter = scene.indenters[int(random.integers(len(scene.indenters)))].build()
        place, force = draw_place(random, scene.pairs), float(np.exp(random.uniform(*np.log(FORCES))))
        heading, length = random.uniform(0, 2 * np.pi), random.uniform(*SLIDES)
        ahead = np.array([np.cos(heading), np.sin(heading)])
        forces = np.r_[np.arange(1, RISE + 1) / RISE, np.ones(HOLD), np.arange(FALL, 0, -1) / (FALL + 1)] * force
        moved = np.clip((np.arange(len(forces)) - RISE) / HOLD, 0, 1)
        try:
            if motion == "roll":
                contacts = rolled(indenter, place, forces, moved, ahead, scene.pairs.friction)
            else:
                slides = moved[:, None] * ahead * (length if motion == "slide" else 0.0)
                steps = [Step(force=f, slide=tuple(s)) for f, s in zip(forces.tolist(), slides.tolist(), strict=True)]
                paths = (solve_path(each, indenter, place, steps, friction=scene.pairs.friction) for each in SENSORS)
                contacts = list(zip(*paths, strict=True))
        except TactileError:  # more than 60 % of a thickness, or a roll off the gel
            continue
        if all(found.converged and found.contact_patch.any() for both in contacts for found in both):
            return described(contacts)


def rolled(indenter, place: Placement, forces, moved, ahead, friction: float) -> list[Contact]:  # noqa: ANN001
    """Solve a roll on both sensors: the indenter leans over from -LEAN / 2 to LEAN / 2 and moves by ROLLED meanwhile.
    forces : (F,) N; moved : (F,), share of the way, 0 to 1; ahead : (2,), its unit vector x, z; friction : Coulomb's"""
    contacts = []
    for force, share in zip(forces.tolist(), (moved - 0.5).tolist(), strict=True):
        x, z = np.array([place.x, place.z]) + share * ROLLED * ahead
        at = Placement(float(x), float(z), abs(share) * LEAN, float(np.arctan2(*(np.sign(share) * ahead[::-1]))))
        contacts.append(tuple(solve(each, indenter, at, force=force, friction=friction) for each in SENSORS))
    return contacts


def described(contacts: list[Contact]) -> dict[str, np.ndarray]:
    """Return a sequence's signals and true contacts, by name, with frames of rest added before and after.

    signal (40, 19) float16 counts; force (40,) float32 N, its size on the BioTac; of the gel: center (40, 2) float32 m,
    of the dent, NaN without contact; peak (40,) float32 m, greatest depth; patch (40, M / 8) uint8, nodes in contact,
    a bit each"""
    around = (REST, AFTER)
    gels = np.stack([digit.displacement for _, digit in contacts])
    center = accuracy.dent_center(gels, sensors.digit_surface().rest)
    arrays = {
        "signal": np.stack([signal_of(biotac) for biotac, _ in contacts]).astype(np.float16),
        "force": np.array([np.linalg.norm(biotac.force) for biotac, _ in contacts], np.float32),
        "peak": accuracy.height(gels).max(axis=1).astype(np.float32),
        "patch": np.packbits(np.stack([digit.contact_patch for _, digit in contacts]), axis=1),
    }
    padded = {name: np.pad(array, (around, *[(0, 0)] * (array.ndim - 1))) for name, array in arrays.items()}
    return padded | {"center": np.pad(center, (around, (0, 0)), constant_values=np.nan).astype(np.float32)}


if __name__ == "__main__":
    sys.exit(main())
