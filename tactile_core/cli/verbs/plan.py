"""``tactile plan``: estimate what a scene's or a recording's outputs build and cost."""

from __future__ import annotations

import argparse

from ..terminal import tell
from .common import NOTHING, error_argument

BRIEF = "estimate time, memory and disk of a command, without running it"
TEXT = """\
List what the outputs of a scene (by `tactile simulate`, then `convert` and `render`) or of a recording (by `tactile
convert`) build: sensors and their nodes, matrices (cached, or to be built), contacts and their tiers, networks, lights;
and estimate time, memory and disk from measured tables that ship.
Nothing is written. Where a scene's matrices are cached, contacts on its motion are solved to know their depth."""
EPILOG = """\
examples:
  tactile plan scenes/press
  tactile plan scenes/press --keep electrodes
  tactile plan scenes/press --keep image --error 50um,0.5levels --json
  tactile plan scenes/press_roll_slide/press_roll_slide.h5 --keep latent"""
LEAVES = NOTHING


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("input", metavar="INPUT", help="scene (scene.toml or its folder), or a recording")
    verb.add_argument(
        "--keep",
        metavar="WORDS",
        help="outputs; for a scene out of electrodes,displacement_biotac,displacement_digit,translation,image (default:"
        " all); for a recording out of latent,displacement,height,image (default: those of `convert`)",
    )
    verb.add_argument("--preset", metavar="NAME", help="preset of the pictures (default: as of `render`, `convert`)")
    error_argument(verb, "um of surfaces, levels of pictures, or both: 50um,0.6levels")
    verb.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print what a scene or a recording will build, and its cost; returns the exit status."""
    import json

    from ...jobs import plan
    from ...jobs.error_budget import Budget, parse_budget

    budget = Budget() if options.error is None else parse_budget(options.error)
    found = plan.plan(options.input, options.keep, budget, options.preset)
    tell(json.dumps(found.as_json(), indent=2) if options.json else "\n".join(found.lines()))
    return 0
