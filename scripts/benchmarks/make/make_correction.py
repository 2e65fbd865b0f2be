"""Make the fast tier's correction: solve a sample of presses in the full tier, learn from them, write one small file.

    python scripts/benchmarks/make/make_correction.py --work DIR [--presses 155] [--rubbing 49] [--seed 0] [--workers 2]

Stop it at any time: presses that are solved stay in DIR and are not solved again. Writes
tactile_core/data/mechanics_correction.npz and prints how far the corrected fast tier is from the full tier on held-out
presses. All presses are solved without friction, the first ones with friction too. Two hours on two cores.
"""

from __future__ import annotations

import argparse
import logging
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))  # `benchmarks` is no package that is installed

from benchmarks.make import learn_correction
from benchmarks.measured_rows import finished, in_processes, parser_of, printed
from benchmarks.mechanics.random_contacts import random_contacts
from tactile_core.files import atomic
from tactile_core.files.shipped import shipped
from tactile_core.mechanics.fast import correction
from tactile_core.mechanics.placement import FRICTION

SENSORS = "digit", "biotac"


def file_of(folder: pathlib.Path, sensor: str, seed: int, number: int, friction: float) -> pathlib.Path:
    """Return the path of the file in ``folder`` that holds the full tier's contacts of a press.
    seed, number : of the random contact; friction : Coulomb's coefficient"""
    return folder / f"{sensor}_{seed}_{number:05d}_friction_{friction:g}.npz"


def solve_one(job: tuple[pathlib.Path, str, int, int, float]) -> str:
    """Solve a press unless its file is there; return a line to print. job : folder, sensor, seed, number, friction"""
    _, sensor, seed, number, friction = job
    path = file_of(*job)
    if path.exists():
        return f"{path.name}: was there"
    press = list(random_contacts(number + 1, seed))[-1]
    found = learn_correction.full_press(sensor, press, friction)
    with atomic.new_file(path) as partial, open(partial, "wb") as file:
        np.savez(file, **found)
    solved = len(found["force"])
    return f"{path.name}: {press.name}, {solved} of {len(found['depths'])} contacts, {found['seconds'].sum():.1f} s"


def wanted_contacts(arguments: argparse.Namespace) -> list[tuple[int, float]]:
    """List (press, coefficient of friction) to solve: all presses without friction, then the first ones with it.
    arguments : the command line's, here and in ``learn_all``"""
    rubbing = [(number, FRICTION) for number in range(min(arguments.rubbing, arguments.presses))]
    return [(number, 0.0) for number in range(arguments.presses)] + rubbing


def learn_all(arguments: argparse.Namespace) -> list[dict]:
    """Read every solved press, learn both sensors' corrections and write them; returns rows of errors."""
    rows, arrays = [], {}
    for sensor in SENSORS:
        samples, wanted, solved = [], 0, 0
        presses = list(random_contacts(arguments.presses, arguments.seed))
        for number, friction in wanted_contacts(arguments):
            press = presses[number]
            with np.load(file_of(arguments.work, sensor, arguments.seed, number, friction), allow_pickle=False) as file:
                full = dict(file)
            wanted, solved = wanted + len(full["depths"]), solved + len(full["force"])
            samples += learn_correction.paired(sensor, number, press, friction, full)
        print(f"{sensor}: {solved} of {wanted} contacts solved in the full tier, {len(samples)} in both", flush=True)
        learned, found = learn_correction.learn(sensor, samples)
        rows += found
        for kind, parts in vars(learned).items():
            arrays |= {f"{sensor}_{kind}_{name}": values for name, values in vars(parts).items()}
    path = shipped(correction.FILE)
    with atomic.new_file(path) as partial, open(partial, "wb") as file:
        np.savez_compressed(file, **arrays)
    print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")
    return rows


def main() -> int:
    """Solve the presses, learn the correction, write and report it; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for the solved presses")
    parser.add_argument("--presses", type=int, default=155, help="presses a sensor, three contacts each (155)")
    parser.add_argument("--rubbing", type=int, default=49, help="of them also with friction (49)")
    parser.add_argument("--seed", type=int, default=0, help="of the presses (0)")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    arguments.work.mkdir(parents=True, exist_ok=True)
    jobs = [
        (arguments.work, sensor, arguments.seed, number, friction)
        for number, friction in wanted_contacts(arguments)
        for sensor in SENSORS
    ]
    in_processes(solve_one, jobs, arguments.workers)
    return finished(printed(learn_all(arguments)), arguments.json)


if __name__ == "__main__":
    sys.exit(main())
