"""Judge the translation against the simulated truth and on recordings of a real BioTac, beside doing nothing.

    python scripts/evaluate_translation.py --json FILE              on the test contacts that ship
    python scripts/evaluate_translation.py --kept-apart FOLDER      and networks kept from some of it (again for more)
    python scripts/evaluate_translation.py --recordings DIR         on recordings, matM_K_{bio,cw,cp}.csv; --quick: six

Prints a table; exits 1 when an error row misses its target. Needs scipy, of the extra [fem]. The recordings'
translations are left in --out, in the form that judge_recordings.py, the tool beside the recordings, reads.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from tactile_core import atomic, translate
from tactile_core.errors import TactileError
from tactile_core.evaluation import recordings, test_set
from tactile_core.evaluation.model_card import write_model_card
from tactile_core.evaluation.translation import our_bodies
from tactile_core.paired_contacts import read_pairs
from tactile_core.recordings import sensor_file
from tactile_core.rows import HEADER, Row, failed, line

QUICK = 6  # recordings
QUICK_PRESSES = 7  # of as many one is looked at; prime to how box, ring and others take turns
TEST_SET = Path(__file__).resolve().parent.parent / "scenes" / "training" / "test_contacts.h5"


def main(arguments: list[str] | None = None) -> int:
    """Translate, measure, print, write; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--test-set", default=TEST_SET, metavar="FILE", help="pairs of the full tier (%(default)s)")
    parser.add_argument(
        "--kept-apart",
        action="append",
        default=[],
        metavar="FOLDER",
        help="weights of `tactile train --without ...`; may be given several times",
    )
    parser.add_argument("--recordings", metavar="DIR", help="matM_K_{bio,cw,cp}.csv, flat or in matM/, in its place")
    parser.add_argument("--weights", metavar="FOLDER", help="networks of your own training instead of the shipped ones")
    parser.add_argument("--sensor", metavar="FILE", help="gains and offsets of their sensor, from `tactile adapt`")
    parser.add_argument("--out", default="out/translated", metavar="FOLDER", help="translations (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", help="write the rows here")
    parser.add_argument("--card", metavar="FILE", help="write the model card (Markdown, and a picture beside it) here")
    parser.add_argument("--sweep", metavar="FILE", help="rows of scripts/sweep_networks.py, for the card")
    parser.add_argument("--quick", action="store_true", help="a few recordings, or a few test presses")
    options = parser.parse_args(arguments)
    try:
        network = translate.load_translator(options.weights)
        found = on_recordings(network, options) if options.recordings else on_test_set(network, options)
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    print(HEADER)
    for row in found:
        print(line(row))
    if options.json:
        atomic.write_json(Path(options.json), found)
    for row in failed(found):
        print(f"MISSED: {row['name']} = {row['value']} {row['unit']}, target {row['target']}", file=sys.stderr)
    return int(bool(failed(found)))


def on_recordings(network: translate.Translator, options: argparse.Namespace) -> list[Row]:
    """Rows of real recordings."""
    sensor = None if options.sensor is None else sensor_file.read(options.sensor)
    return recordings.rows(options.recordings, network, options.out, QUICK if options.quick else None, sensor)


def on_test_set(network: translate.Translator, options: argparse.Namespace) -> list[Row]:
    """Rows of simulated contacts."""
    pairs, bodies = read_pairs(options.test_set), our_bodies()
    if options.quick:
        pairs = pairs.some(np.flatnonzero(pairs.press % QUICK_PRESSES == 0))
    found = [*test_set.seen_rows(network, pairs, bodies), *test_set.speed_rows(network, pairs)]
    apart = [translate.load_translator(folder) for folder in options.kept_apart]
    for unaware in apart:
        found += test_set.unseen_rows(unaware, pairs, bodies)
    if options.card:
        sweep = json.loads(Path(options.sweep).read_text()) if options.sweep else []
        write_model_card(Path(options.card), found, network, pairs, apart, sweep)
    return found


if __name__ == "__main__":
    sys.exit(main())
