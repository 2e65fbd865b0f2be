"""Arguments and helpers that several verbs share."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ...errors import TactileError

if TYPE_CHECKING:
    from ...recordings.tables.column_map import ColumnMap

# What a stopped verb leaves.
NOTHING = "no half file is left"
RESUMES = "the same command goes on where it stopped"

# Of pictures.presets and sensors, without importing them: help is to be quick.
PRESETS = ("fast", "standard", "quality", "reference")
SOURCE, TARGET = "biotac", "digit"
MAX_SEED = 2**32 - 1  # what numpy's and torch's generators both take


def progress_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--progress``."""
    verb.add_argument(
        "--progress", action="store_true", help="show the bar of progress even where stderr is no terminal"
    )


def prepare_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments that control how readings become signals."""
    tare_argument(verb)
    verb.add_argument(
        "--kind",
        choices=("raw", "tared", "scaled", "rectified"),
        help="what the electrodes' numbers are, where `tactile info` guesses wrong: raw, readings of 0 to 4095; tared,"
        " changes against rest; scaled, changes in another unit; rectified, changes without their sign",
    )
    polarity_argument(verb)
    columns_argument(verb)
    verb.add_argument("--counts-per-unit", type=float, metavar="X", help="factor from the file's unit to counts")
    verb.add_argument(
        "--smooth", type=int, metavar="N", help="average over N frames, odd (default: 3 if rectified, else 1)"
    )
    verb.add_argument("--no-drift", action="store_true", help="do not remove drift")


def tare_argument(verb: argparse.ArgumentParser, among: str = "") -> None:
    """Add ``--tare``; among : which frames it names, in words."""
    about = f"frames without contact{among} that give the resting reading (default: found automatically)"
    verb.add_argument("--tare", default="auto", metavar="auto|none|A:B", help=about)


def polarity_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--polarity``."""
    verb.add_argument(
        "--polarity",
        choices=("auto", "falls", "rises"),
        default="auto",
        help="direction of the counts where the fluid film over an electrode gets thinner: raw counts fall, files that"
        " hold rest minus reading rise (default: as the file states, else as the recording shows)",
    )


def columns_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--columns``."""
    verb.add_argument(
        "--columns",
        metavar="MAP.toml",
        help="map of the columns, fields or arrays of a file in no known layout; `tactile info --columns` writes one",
    )


def columns_of(options: argparse.Namespace) -> ColumnMap | None:
    """Return the map that ``--columns`` names; None where it is not given."""
    if options.columns is None:
        return None
    from ...recordings.tables import column_map

    return column_map.read(options.columns)


def electrodes_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--electrodes``."""
    verb.add_argument(
        "--electrodes",
        choices=("sheet", "gap"),
        default="sheet",
        help="law from the fluid film's thickness to counts: sheet, current in a conducting sheet, 3 ms a contact; gap,"
        " one over the thickness under each electrode, at no cost and less like real fingers (default: sheet)",
    )


def answer_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments that control the estimate for a frame; see ``translation.answer``."""
    verb.add_argument(
        "--answer",
        choices=("likely", "mean"),
        default="likely",
        help="estimate of a frame: likely, its most plausible contact; mean, the mean over all its plausible contacts,"
        " each frame alone, which is blurred where two places fit the signals (default: likely)",
    )
    verb.add_argument(
        "--frames-apart",
        action="store_true",
        help="translate each frame alone, instead of following the contact through the frames before and after",
    )
    verb.add_argument(
        "--mount-shift",
        metavar="X,Z",
        help="mount the BioTac elsewhere on the DIGIT: shift all contacts by X mm along the finger (+x is from the tip"
        " to the base) and Z mm across it, so that those at the tip come into the picture",
    )
    verb.add_argument(
        "--samples",
        type=int,
        default=0,
        metavar="N",
        help="also draw N contacts a frame from the posterior, as sample_center and sample_force in frames.h5",
    )
    verb.add_argument(
        "--gel",
        choices=("translated", "solved"),
        default="translated",
        help="displacement of the gel: translated, by the networks; solved, by contact mechanics, a ball of the"
        " dent's curvature at the estimated place and force, 25 ms a frame, needs scipy (default: translated)",
    )


def target_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--to``."""
    verb.add_argument(
        "--to",
        dest="target",
        default=TARGET,
        metavar="SENSOR",
        help="gel to translate to: any sensor with a gel (docs/extend.md); where the networks do not lead to it, its"
        " displacement is solved by contact mechanics (default: %(default)s)",
    )


def unit_arguments(verb: argparse.ArgumentParser) -> None:
    """Add ``--sensor``, ``--to``, ``--weights`` and ``--calibration``: what translates, and between which units."""
    verb.add_argument("--sensor", metavar="FILE", help="rest, gains and offsets of the unit, from `tactile adapt`")
    target_argument(verb)
    weights_argument(verb)
    verb.add_argument(
        "--calibration", metavar="FILE", help="camera and lights, by `tactile calibrate` (default: those that ship)"
    )


def object_argument(verb: argparse.ArgumentParser, whose: str) -> None:
    """Add ``--object-reflectance``; whose : the object that it is of and what it defaults to, in words."""
    about = f"reflectance, 0 black to 1 white, of {whose}; it shows through the gel's coating"
    verb.add_argument("--object-reflectance", type=float, metavar="R", help=about)


def weights_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--weights``."""
    verb.add_argument("--weights", metavar="DIR", help="networks from `tactile train` (default: those that ship)")


def error_argument(verb: argparse.ArgumentParser, what: str) -> None:
    """Add ``--error``; what : the units that mean something here, in words."""
    verb.add_argument("--error", metavar="BOUND", help=f"the largest error that the toolkit itself may add: {what}")


def seed_argument(verb: argparse.ArgumentParser, same: str) -> None:
    """Add ``--seed``; ``same`` : the output that a seed determines, in words."""
    verb.add_argument(
        "--seed", type=int, default=0, metavar="S", help=f"random seed; same seed, same {same} (default: 0)"
    )


def check_seed(seed: int) -> None:
    """Raise TactileError for a seed that the generators do not take."""
    if not 0 <= seed <= MAX_SEED:
        raise TactileError("--seed", str(seed), f"0 to {MAX_SEED}", "Give another one")


def prepare_words(options: argparse.Namespace) -> dict[str, Any]:
    """Return the fields of ``recordings.PrepareOptions`` from the arguments of a verb that prepares recordings."""
    return {
        "kind": options.kind,
        "tare": None if options.tare == "auto" else options.tare,
        "drift": not options.no_drift,
        "counts_per_unit": options.counts_per_unit,
        "smooth": options.smooth,
        "polarity": options.polarity,
        "columns": columns_of(options),
    }
