"""Arguments and helpers that several verbs share."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ...errors import TactileError

if TYPE_CHECKING:
    from ...recordings.column_map import ColumnMap

# What a stopped verb leaves.
NOTHING = "no half file is left"
RESUMES = "the same command goes on where it stopped"

PRESETS = ("fast", "standard", "quality", "reference")  # of optics.presets, without importing it
MAX_SEED = 2**32 - 1  # what numpy's and torch's generators both take


def progress_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--progress``."""
    verb.add_argument("--progress", action="store_true", help="show progress even where stderr is no terminal")


def prepare_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments that control how readings become signals."""
    verb.add_argument(
        "--tare",
        default="auto",
        metavar="auto|none|A:B",
        help="frames without contact that give the resting reading (default: found automatically)",
    )
    verb.add_argument(
        "--kind",
        choices=("raw", "tared", "scaled", "rectified"),
        help="what the file holds, where the automatic answer is wrong",
    )
    polarity_argument(verb)
    columns_argument(verb)
    verb.add_argument("--counts-per-unit", type=float, metavar="X", help="factor to counts, for a scaled recording")
    verb.add_argument(
        "--smooth", type=int, metavar="N", help="average over N frames, odd (default: 3 if rectified, else 1)"
    )
    verb.add_argument("--no-drift", action="store_true", help="do not remove drift")


def polarity_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--polarity``."""
    verb.add_argument(
        "--polarity",
        choices=("auto", "falls", "rises"),
        default="auto",
        help="what counts do where the film over an electrode thins: fall, as raw ones do, or rise, in files that hold"
        " rest minus reading (default: as the file says, or the recording shows)",
    )


def columns_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--columns``."""
    verb.add_argument(
        "--columns",
        metavar="MAP.toml",
        help="which column of a CSV file is what, where its names are of no known layout; `tactile info --columns`"
        " writes such a map",
    )


def columns_of(options: argparse.Namespace) -> ColumnMap | None:
    """Return the map that ``--columns`` names; None where it is not given."""
    if options.columns is None:
        return None
    from ...recordings import column_map

    return column_map.read(options.columns)


def electrodes_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--electrodes``."""
    verb.add_argument(
        "--electrodes",
        choices=("sheet", "gap"),
        default="sheet",
        help="how the fluid's film becomes counts: as a conducting sheet, 3 ms a contact, or one over the gap under"
        " each electrode, at no cost and less like real fingers (default: sheet)",
    )


def answer_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments that control the estimate for a frame; see ``translation.answer``."""
    verb.add_argument(
        "--answer",
        choices=("likely", "mean"),
        default="likely",
        help="by the most plausible contact, sharp; or by the mean of all that are plausible, each frame alone, which"
        " blurs where signals leave two places open (default: likely)",
    )
    verb.add_argument(
        "--frames-apart",
        action="store_true",
        help="translate each frame alone, instead of following the contact through the frames before and after",
    )
    verb.add_argument(
        "--mount-shift",
        metavar="X,Z",
        help="lay the BioTac elsewhere on the DIGIT: move all contacts by so many mm along and across the gel, so that"
        " those at the tip come into the picture; +x leads from the tip to the base",
    )
    verb.add_argument(
        "--samples",
        type=int,
        default=0,
        metavar="N",
        help="draw N contacts a frame from its posterior, as sample_center and sample_force in frames.h5",
    )
    verb.add_argument(
        "--gel",
        choices=("translated", "solved"),
        default="translated",
        help="the gel as the networks translate it, or by contact mechanics: a ball of the dent's curvature at"
        " the found place and force, some 10 ms a frame; needs the extra [fem] (default: translated)",
    )


def target_argument(verb: argparse.ArgumentParser) -> None:
    """Add ``--to``."""
    verb.add_argument(
        "--to",
        dest="target",
        default="digit",
        metavar="SENSOR",
        help="gel to translate to, any with a descriptor; one that no networks lead to is solved by contact mechanics"
        " (default: %(default)s)",
    )


def error_argument(verb: argparse.ArgumentParser, what: str) -> None:
    """Add ``--error``; what : the units that mean something here, in words."""
    verb.add_argument("--error", metavar="BOUND", help=f"the largest error that the toolkit itself may add: {what}")


def seed_argument(verb: argparse.ArgumentParser, same: str) -> None:
    """Add ``--seed``; ``same`` : the output that a seed determines, in words."""
    verb.add_argument("--seed", type=int, default=0, metavar="S", help=f"same seed, same {same} (default: 0)")


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
