"""``tactile pairs``: simulate paired contacts of both sensors."""

from __future__ import annotations

import argparse
from shlex import quote

from ...files.threads import one_thread
from ..terminal import bar, next_step, say, tell
from . import engine
from .common import RESUMES, SOURCE, TARGET, add, check_seed

BRIEF = "simulate the same contacts on two sensors, to train on"
TEXT = "Simulate random contacts of a scene's indenters on two sensors, at the same force, angle and place on both."
EPILOG = """\
example:
  tactile pairs scenes/press_sphere/scene.toml --count 2000 --seed 1 --out pairs.h5 --workers 4

  tactile pairs SCENE --count 50000 --out pairs.h5 --plan       and then, on each of 8 machines:
  tactile batch --out pairs.h5.parts --array 0/8                then the first line again, which puts all together

  TACTILE_SENSORS=scenes/sensors tactile pairs SCENE --count 20 --to flat_gel --out flat.h5      a gel of your own

An interrupted run goes on where it stopped when the same command is given again."""
LEAVES = RESUMES


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("scene", metavar="SCENE", help="scene.toml: indenters, ranges of places, angles, depths")
    verb.add_argument("--count", type=int, required=True, metavar="N", help="number of paired contacts")
    add(verb, "--seed", same="file")
    about = "HDF5 file to write; FILE.card.json beside it describes it"
    verb.add_argument("--out", required=True, metavar="FILE", help=about)
    for word, role, sensor, about in (
        ("--from", "source", SOURCE, "sensor translated from (default: %(default)s)"),
        ("--to", "target", TARGET, "gel to translate to (default: %(default)s); yours is a folder in $TACTILE_SENSORS"),
    ):
        verb.add_argument(word, dest=role, default=sensor, metavar="SENSOR", help=about)
    about = "traction: also keep the force field on both surfaces, Pa on each node, float32"
    verb.add_argument("--keep", metavar="WORDS", help=about)
    engine.parts_arguments(verb, "print the cost, write the job into OUT.parts and stop")
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Simulate the paired contacts of a scene; returns the exit status."""
    one_thread()  # before numpy is imported
    engine.check_place(options, "workers")
    check_seed(options.seed)
    from ...jobs import pairs, plan, results
    from ...simulation.pairs_file import KEEPABLE

    pair = options.source, options.target
    keep = () if options.keep is None else results.parse_words(options.keep, tuple(KEEPABLE))
    if options.plan:
        job, _, _ = pairs.plan(options.scene, options.count, options.seed, options.out, pair, keep)
        for line in plan.of_pairs(options.count, pair).lines():
            say(line)
        return engine.plan_parts(options.out, job)
    place = engine.place_of(options)
    with bar("pairs", "block", options.progress) as shown:
        pairs.make_pairs(
            options.scene, options.count, options.seed, options.out, progress=shown, place=place, pair=pair, keep=keep
        )
    tell(options.out)
    next_step(f"tactile train {quote(options.out)} --out trained")
    return 0
