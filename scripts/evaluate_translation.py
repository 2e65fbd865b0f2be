"""Judge the translation against the simulated truth and on recordings of a real BioTac, beside doing nothing.

    python scripts/evaluate_translation.py --json FILE              on the test contacts that ship
    python scripts/evaluate_translation.py --held-out FOLDER      and networks kept from some of it (again for more)
    python scripts/evaluate_translation.py --recordings DIR         on real recordings: slides (but sample 7 of each
                                                                    material) or grips; --quick: six slides

Prints a table; exits 1 when an error row misses its target. Needs scipy, of the extra [fem].
"""

from __future__ import annotations

import argparse
import functools
import sys
from pathlib import Path

import numpy as np
from benchmarks.measured_rows import finished, parser_of, printed
from benchmarks.translation import body_rows, grips, made_up_units, sequence_rows, slides, test_set, two_contact_rows
from benchmarks.translation.model_card import renew_model_card

from tactile_core.accuracy import Row
from tactile_core.errors import TactileError
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.training.step_errors import our_bodies
from tactile_core.translation import translate
from tactile_core.translation.translator import Translator

QUICK = 6  # recordings
QUICK_CONTACTS = 30  # of other bodies
QUICK_PRESSES = 7  # one press, or sequence, in so many is looked at; prime to how box, ring and others take turns
TEST_SET = Path(__file__).resolve().parents[1] / "scenes" / "training" / "test_contacts.h5"


def main(arguments: list[str] | None = None) -> int:
    """Translate, measure, print and write the rows; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--test-set", default=TEST_SET, metavar="FILE", help="pairs of the full tier (%(default)s)")
    parser.add_argument(
        "--held-out",
        action="append",
        default=[],
        metavar="FOLDER",
        help="weights of `tactile train --without ...`; may be given several times",
    )
    real = "slides (matM_K_bio.csv, ...) or grips (*_HOLD.mat) in its place"
    parser.add_argument("--recordings", metavar="DIR", help=real)
    parser.add_argument("--weights", metavar="FOLDER", help="networks of your own training instead of the shipped ones")
    parser.add_argument("--sensor", metavar="FILE", help="gains and offsets of their sensor, from `tactile adapt`")
    parser.add_argument(
        "--card", metavar="FILE", help="renew the tables of this model card, and CSV and picture beside it"
    )
    parser.add_argument("--quick", action="store_true", help="a few recordings, or a few test presses")
    options = parser.parse_args(arguments)
    if options.card and not Path(options.card).is_file():
        parser.error(f"--card {options.card}: no such page; docs/translation.md is one")
    try:
        network = translate.load_translator(options.weights)
        found = on_recordings(network, options) if options.recordings else on_test_set(network, options)
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    return finished(printed(found), options.json)


def on_recordings(network: Translator, options: argparse.Namespace) -> list[Row]:
    """Measure real recordings: grips of the PHAC set where the folder holds them, else slides."""
    folder = Path(options.recordings)
    if grips.find(folder):
        return grips.rows(folder, network, read_pairs(options.test_set))
    as_asked = functools.partial(translate.translate, sensor=options.sensor, weights=options.weights)
    return slides.rows(folder, as_asked, QUICK if options.quick else None)


def on_test_set(network: Translator, options: argparse.Namespace) -> list[Row]:
    """Measure simulated contacts, and renew the model card if one is named. options : the command line's"""
    pairs, bodies = read_pairs(options.test_set), our_bodies()
    if options.quick:
        pairs = pairs.select_rows(np.flatnonzero(pairs.press % QUICK_PRESSES == 0))
    found = test_set.seen_rows(network, pairs, bodies)
    found += sequence_rows.rows(network, every=QUICK_PRESSES if options.quick else 1)
    found += body_rows.rows(network, pairs, bodies, QUICK_CONTACTS if options.quick else body_rows.COUNT)
    found += two_contact_rows.rows(pairs) + two_contact_rows.translated_rows(network, pairs)
    few = (2, 2) if options.quick else ()
    found += made_up_units.rows(network, *few) + made_up_units.reliability(network, *few)
    apart = [translate.load_translator(folder) for folder in options.held_out]
    for unaware in apart:
        found += test_set.unseen_rows(unaware, pairs, bodies)
    if options.card:
        renew_model_card(Path(options.card), found, network, pairs, apart)
    return found


if __name__ == "__main__":
    sys.exit(main())
