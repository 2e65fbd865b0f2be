"""``tactile dataset``: convert a public set of recordings to labelled DIGIT pictures with a card."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...errors import TactileError
from ..terminal import bar, next_step, say, tell
from . import engine
from .common import PRESETS, RESUMES, add
from .export import LAYOUTS

BRIEF = "convert a whole data set, from its folder to labelled pictures with a card"
TEXT = """\
List the data sets that are known, or convert one. A recipe, one TOML file per set, says which files of FOLDER are
recordings, how their units are found, what is held out for testing, and whose the data are. DIR then holds
  README.md     card: what it was made from, how far to trust it, how much of its labels survives (with scikit-learn)
  index.html    every recording as a strip of pictures, filtered by label and flag; needs no network
  imagefolder/  pictures and metadata.csv, as Hugging Face's library `datasets` loads them; other layouts by --to
  units/ jobs/  the file of `tactile adapt` of each unit, and the jobs of `tactile batch`
The same command continues after any interruption. For a set of your own, --new writes a recipe to fill in."""
EPILOG = """\
examples:
  tactile dataset
  tactile dataset phac2 downloads/phac --out phac_digit --workers 4
  tactile dataset sp_stability downloads/stability --out stability --to imagefolder,lerobot
  tactile dataset --new mine.toml my_recordings
  tactile dataset mine.toml my_recordings --out mine_digit"""
LEAVES = RESUMES


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("name", nargs="?", metavar="NAME", help="a known data set, or a recipe's TOML file")
    verb.add_argument("folder", nargs="?", metavar="FOLDER", help="folder of its recordings, at any depth")
    verb.add_argument("--out", metavar="DIR", help="folder of the result")
    verb.add_argument("--new", metavar="FILE", help="write a recipe for NAME, a folder of recordings of your own")
    verb.add_argument(
        "--to", dest="layouts", default="imagefolder", metavar="LAYOUTS",
        help=f"layouts, out of {','.join(LAYOUTS)} (default: imagefolder)",
    )  # fmt: skip
    verb.add_argument("--target", default="digit", metavar="SENSOR", help="as --to of convert (default: digit)")
    verb.add_argument("--pictures", choices=PRESETS, help="as --preset of batch (default: fast)")
    add(verb, "--weights", "--calibration")
    engine.place_arguments(verb)
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """List the known sets, write a recipe, or convert a set; returns the exit status."""
    from ...jobs.dataset import recipe

    if options.new is not None:
        return _new(options)
    if options.name is None:
        for name, file in recipe.known().items():
            tell(f"{name:<22}{recipe.read(str(file)).source.title}")
        next_step("tactile dataset NAME FOLDER --out DIR")
        return 0
    if not options.folder or options.out is None:
        raise TactileError("dataset", f"{options.name} alone", "NAME FOLDER --out DIR", "See `tactile dataset --help`")
    from ...jobs.dataset import build_set

    layouts = list(dict.fromkeys(word for word in options.layouts.split(",") if word))
    unknown = [word for word in layouts if word not in LAYOUTS]
    if unknown or not layouts:
        raise TactileError("--to", repr(", ".join(unknown)), f"one or more of {', '.join(LAYOUTS)}")
    engine.check_place(options, "workers")
    asked = build_set.Asked(
        layouts, engine.place_of(options), say, lambda name, unit: bar(name, unit, options.progress),
        options.target, options.pictures, options.calibration, options.weights,
    )  # fmt: skip
    out = Path(options.out)
    aside = build_set.build(recipe.read(options.name), options.name, Path(options.folder), out, asked)
    for name, why in aside.items():
        say(f"warning: {name} was set aside: {why}")
    tell(f"{out / build_set.CARD}\n{out / build_set.PAGE}")
    next_step(f"open {out / build_set.PAGE} in a browser, and read the card before you use the pictures")
    return 2 if aside else 0


def _new(options: argparse.Namespace) -> int:
    """Write a recipe guessed from a folder."""
    if not options.name:
        raise TactileError("--new", "given alone", "--new FILE FOLDER", "Name the folder of your recordings")
    from ...jobs.dataset import recipe

    recipe.write(Path(options.new), Path(options.name))
    tell(options.new)
    next_step(f"fill it in, then tactile dataset {options.new} {options.name} --out DIR")
    return 0
