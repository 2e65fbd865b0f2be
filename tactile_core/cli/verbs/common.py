"""Arguments and helpers that several verbs share."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ...errors import TactileError

if TYPE_CHECKING:
    from ...recordings.tables.column_map import ColumnMap
    from ...translation.answer import Answer

# What a stopped verb leaves.
NOTHING = "no half file is left"
RESUMES = "the same command goes on where it stopped"

# Of pictures.presets and sensors, without importing them: help is to be quick.
PRESETS = ("fast", "standard", "quality", "reference")
SOURCE, TARGET = "biotac", "digit"
MAX_SEED = 2**32 - 1  # what numpy's and torch's generators both take


# What several verbs offer: the words of argparse; {words} in a help are the verb's own.
OPTIONS: dict[str, dict[str, Any]] = {
    "--progress": {"action": "store_true", "help": "show the progress bar even if stderr is no terminal"},
    "--keep": {"metavar": "WORDS", "help":
        "additional outputs, out of latent,displacement,height,image,traction,marker_motion (default: %(default)s)"},
    "--tare": {"default": "auto", "metavar": "auto|none|A:B", "help":
        "frames without contact{among} that give the resting reading (default: found automatically)"},
    "--kind": {"choices": ("raw", "tared", "scaled", "rectified"), "help":
        "what the electrodes' numbers are, if `tactile info` guesses wrong: raw (readings of 0 to 4095), tared (changes"
        " against rest), scaled (changes in another unit) or rectified (changes without their sign)"},
    "--polarity": {"choices": ("auto", "falls", "rises"), "default": "auto", "help":
        "how counts change where the fluid film over an electrode gets thinner: raw counts fall; those of files that"
        " hold rest minus reading rise (default: as the file states, else as the recording shows)"},
    "--columns": {"metavar": "MAP.toml", "help":
        "map of the columns, fields or arrays of a file in no known layout; `tactile info --columns` writes one"},
    "--counts-per-unit": {"type": float, "metavar": "X", "help": "factor from the file's unit to counts"},
    "--smooth": {"type": int, "metavar": "N", "help":
        "average over N frames, odd (default: 3 if rectified, else 1)"},
    "--no-drift": {"action": "store_true", "help": "do not remove drift"},
    "--answer": {"choices": ("likely", "mean"), "default": "likely", "help":
        "estimate of a frame: likely (its most plausible contact) or mean (over all its plausible contacts, each frame"
        " alone; blurred where two places fit the signals) (default: likely)"},
    "--frames-apart": {"action": "store_true", "help":
        "translate each frame alone, instead of following the contact through the frames before and after"},
    "--mount-shift": {"metavar": "X,Z", "help":
        "shift all contacts by X mm along the finger (+x is from the tip to the base) and Z mm across it, as if the"
        " BioTac were mounted elsewhere on the DIGIT; so those at the tip come into the picture (write a negative X"
        " as --mount-shift=-4,0)"},
    "--samples": {"type": int, "default": 0, "metavar": "N", "help":
        "also draw N contacts a frame from the posterior, as sample_center and sample_force in frames.h5"},
    "--contacts": {"type": int, "choices": (1, 2), "default": 1, "help":
        "2: look for a second contact in each frame, add it to skin and gel, and write second_center and second_force"
        " to frames.h5; a single wide contact of a real finger is mostly taken for two (default: 1)"},
    "--gel": {"default": "translated", "metavar": "HOW", "help":
        "how the gel's displacement is found: translated (by the networks); solved (contact mechanics press a ball of"
        " the dent's curvature at the estimated place and force; 24 ms a frame, needs scipy); ball:28 (the same with a"
        " ball of 28 mm, if you know what touched; ball:2000 for a plate) (default: translated)"},
    "--sensor": {"metavar": "FILE", "help": "rest, film, gains and offsets of the BioTac unit, from `tactile adapt`"},
    "--to": {"dest": "target", "default": TARGET, "metavar": "SENSOR", "help":
        "gel to translate to: any sensor with a gel (docs/extend.md); if the networks do not lead to it, contact"
        " mechanics solve its displacement (default: %(default)s)"},
    "--weights": {"metavar": "DIR", "help": "networks from `tactile train` (default: those that ship)"},
    "--calibration": {"metavar": "FILE", "help":
        "camera and lights, by `tactile calibrate` (default: those that ship)"},
    "--object-reflectance": {"type": float, "metavar": "R", "help":
        "reflectance, 0 black to 1 white, of {whose}; it shows through the gel's coating"},
    "--error": {"metavar": "BOUND", "help": "the largest error that the toolkit itself may add: {bound}"},
    "--seed": {"type": int, "default": 0, "metavar": "S", "help":
        "random seed; the same seed gives the same {same} (default: 0)"},
}  # fmt: skip
# Options that go together: how readings become signals, the estimate for a frame (``translation.answer``), and what
# translates between which units.
PREPARE = "--tare", "--kind", "--polarity", "--columns", "--counts-per-unit", "--smooth", "--no-drift"
ANSWER = "--answer", "--frames-apart", "--mount-shift", "--samples", "--contacts", "--gel"
UNIT = "--sensor", "--to", "--weights", "--calibration"


def add(verb: argparse.ArgumentParser, *names: str, **words: str) -> None:
    """Add shared options ``names``, such as "--tare"; words : the verb's own words for each {name} in their help"""
    for name in names:
        option = OPTIONS[name]
        verb.add_argument(name, **option | {"help": option["help"].format_map({"among": "", **words})})


def columns_of(options: argparse.Namespace) -> ColumnMap | None:
    """Return the map of columns in the file that ``--columns`` names; None without this option."""
    if options.columns is None:
        return None
    from ...recordings.tables import column_map

    return column_map.read(options.columns)


def check_seed(seed: int) -> None:
    """Raise TactileError for a seed outside 0 to 2**32 - 1, which numpy's and torch's generators take."""
    if not 0 <= seed <= MAX_SEED:
        raise TactileError("--seed", str(seed), f"0 to {MAX_SEED}", "Give another one")


def prepare_words(options: argparse.Namespace) -> dict[str, Any]:
    """Return the fields of ``recordings.PrepareOptions`` by name, from the options of a verb on recordings."""
    return {
        "kind": options.kind,
        "tare": None if options.tare == "auto" else options.tare,
        "drift": not options.no_drift,
        "counts_per_unit": options.counts_per_unit,
        "smooth": options.smooth,
        "polarity": options.polarity,
        "columns": columns_of(options),
    }


def parse_answer(options: argparse.Namespace) -> Answer:
    """Return the `Answer` that a command line's options give. Raises TactileError for a shift or a number of samples
    out of range."""
    from ...translation.answer import MOST_SAMPLES, Answer, parse_shift

    if not 0 <= options.samples <= MOST_SAMPLES:
        raise TactileError("--samples", str(options.samples), f"0 to {MOST_SAMPLES}")
    shift = (0.0, 0.0) if options.mount_shift is None else parse_shift(options.mount_shift)
    return Answer(options.answer, options.frames_apart, shift, options.samples, options.contacts)
