"""Judge how well a BioTac's contacts are found on another gel: solved under the shipped networks', and by networks.

    python scripts/benchmarks/judge_gel.py PAIRS [--weights DIR ...] [--json FILE]

PAIRS : contacts that nothing was trained on, as `tactile pairs scenes/training --count 400 --seed 7701 --to
gelsight_mini --out PAIRS` makes. Signals are read with noise of 1.5 counts and gains 10 % apart. Prints a table, of
contacts that press without sliding; baseline: no displacement. Exits 2 when a file cannot be read.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import finished, parser_of, printed
from benchmarks.translation.noise import NOISE
from benchmarks.translation.sequence_rows import plain_signals
from tactile_core import accuracy
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.jobs import solved_gel
from tactile_core.simulation.pairs_file import Pairs, read_pairs
from tactile_core.training.step_errors import digit_columns, our_bodies, parts, true_displacement
from tactile_core.translation.translate import load_translator
from tactile_core.translation.translator import Translation, Translator

GAINS, SEED = 0.1, 0  # standard deviation of the gains' logarithm
DEEP = 0.3e-3  # m, on the BioTac
UNITS = {"rms_um": "um", "place_mm": "mm", "peak_percent": "%", "iou": "1"}


def main() -> int:
    """Run, print, write; the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("pairs", metavar="PAIRS", type=Path)
    parser.add_argument("--weights", metavar="DIR", nargs="*", default=[], help="networks that lead to that gel")
    options = parser.parse_args()
    try:
        pairs = read_pairs(options.pairs)
        networks = {"solved": load_translator()} | {path: load_translator(path, None, None) for path in options.weights}
        found = printed(each for name, one in networks.items() for each in rows(name, gels(one, pairs), pairs))
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    return finished(found, options.json)


def gels(network: Translator, pairs: Pairs) -> np.ndarray:
    """Return the gels (C, M, 3) m found from signals alone: the networks', or where they lead elsewhere solved."""
    random = np.random.default_rng(SEED)
    gain = np.exp(GAINS * random.standard_normal(pairs.signal.shape))
    change = gain * pairs.signal + NOISE * random.standard_normal(pairs.signal.shape)
    found = Translation.joined([network(plain_signals(change[part])) for part in parts(len(change))])
    if network.target == pairs.pair[1]:
        return found.displacement_digit
    return solved_gel.solved(vars(found), pairs.pair[1], network.target)["displacement_digit"]


def rows(name: str, gel: np.ndarray, pairs: Pairs) -> Iterator[Row]:
    """Yield means of the error in contact, and medians of place, depth and overlap of the patches."""
    every = np.arange(len(gel))
    true, still = true_displacement(pairs, "digit", every), ~pairs.slide.any(-1)
    columns = digit_columns("gel", gel, pairs.contact_patch_digit[every], our_bodies(*pairs.pair))
    measured = {
        "rms_um": 1e6 * accuracy.rms_in_contact(gel, true),
        "place_mm": columns["gel_position_mm"],
        "peak_percent": 100 * np.abs(accuracy.peak_depth_error(gel, true)),
        "iou": columns["gel_iou"],
    }
    nothing = 1e6 * accuracy.rms_in_contact(np.zeros_like(true), true)
    for of, inside in (("all", still), ("deeper than 0.3 mm", still & (pairs.depth_biotac >= DEEP))):
        for metric, values in measured.items():
            known = values[inside][np.isfinite(values[inside])]
            value = float(known.mean() if metric == "rms_um" else np.median(known))
            baseline = round(float(nothing[inside].mean()), 1) if metric == "rms_um" else None
            yield row(f"{name}_{metric}", value, UNITS[metric], baseline=baseline, of=f"{inside.sum()} contacts, {of}")


if __name__ == "__main__":
    sys.exit(main())
