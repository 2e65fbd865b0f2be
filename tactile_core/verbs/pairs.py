"""``tactile pairs``: paired contacts of both sensors."""

from __future__ import annotations

import argparse

from ..errors import TactileError
from ..terminal import bar, tell
from .common import RESUMES, check_seed, progress_argument, seed_argument

BRIEF = "simulate paired contacts"
TEXT = "Simulate contacts of a scene's indenters with both sensors: same force, angle and place."
EPILOG = """\
example:
  tactile pairs scenes/press_sphere/scene.toml --count 2000 --seed 1 --out pairs.h5 --workers 4

An interrupted run goes on where it stopped when the same command is given again."""
LEAVES = RESUMES


def arguments(verb: argparse.ArgumentParser) -> None:
    """Of this verb."""
    verb.add_argument("scene", metavar="SCENE", help="scene.toml: indenters and their range of places, angles, depths")
    verb.add_argument("--count", type=int, required=True, metavar="N", help="number of paired contacts")
    seed_argument(verb, "file")
    verb.add_argument(
        "--out", required=True, metavar="FILE", help="HDF5 file to write; FILE.card.json, what is in it, goes beside"
    )
    verb.add_argument("--workers", type=int, default=1, metavar="N", help="processes; changes no bit (default: 1)")
    progress_argument(verb)


def run(options: argparse.Namespace) -> int:
    """Make the pairs."""
    if options.workers < 1:
        raise TactileError("--workers", str(options.workers), "1 or more", "Give the number of processes")
    check_seed(options.seed)
    from ..mechanics.pairs import make_pairs

    with bar("pairs", "contact", options.progress) as shown:
        make_pairs(options.scene, options.count, options.seed, options.out, options.workers, shown)
    tell(options.out)
    return 0
