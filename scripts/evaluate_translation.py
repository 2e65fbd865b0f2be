"""Judge the translation, on simulated contacts of known truth and on recordings of a real BioTac, beside baselines.

    python scripts/evaluate_translation.py --json FILE              on the test contacts that ship
    python scripts/evaluate_translation.py --held-out FOLDER      also networks that were trained without some of it
    python scripts/evaluate_translation.py --recordings DIR         on real recordings: slides (but sample 7 of each
                                                                    material) or grips; --quick: six slides

Prints a table; exits 1 when an error row misses its target. Needs scipy, of the extra [fem].
"""

from __future__ import annotations

import argparse
import functools
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from benchmarks.measured_rows import finished, parser_of, png_of, printed, renew_tables, short, write_table
from benchmarks.translation import body_rows, grips, made_up_units, sequence_rows, slides, test_set, two_contact_rows
from benchmarks.translation.test_set import SEED, as_read

from tactile_core import sensors
from tactile_core.accuracy import Row, rms_in_contact
from tactile_core.errors import TactileError
from tactile_core.files import atomic
from tactile_core.simulation.pairs_file import Pairs, read_pairs
from tactile_core.training.step_errors import our_bodies, true_displacement
from tactile_core.translation import translate
from tactile_core.translation.translator import Translator

QUICK = 6  # recordings
QUICK_CONTACTS = 30  # of other bodies
QUICK_PRESSES = 7  # one press, or sequence, in so many is looked at; prime to how box, ring and others take turns
TEST_SET = Path(__file__).resolve().parents[1] / "scenes" / "training" / "test_contacts.h5"
PICTURE = "translation_cases.png"
# Words of an estimate, its row, and what the number is followed by.
EXPECTED = (
    ("place of the contact on the gel", "likely_place_mm", " mm"),
    ("force", "likely_force_size_percent", " %"),
    ("depth of the gel's dent", "likely_peak_percent", " %"),
    ("overlap with the true contact patch, best is 1", "likely_iou", ""),
)
SHALLOW, DEEP = "0.1 to 0.3 mm deep", "deeper than 0.3 mm"  # in the sets of these rows
HEAD = f"| estimate, median error | {SHALLOW} | nearest example | {DEEP} | nearest example |"
CONDITIONS = "| condition | of these networks and contacts |", "|---|---|"


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
    """Return rows on real recordings: on grips of the PHAC set if the folder holds some, else on slides."""
    folder = Path(options.recordings)
    if grips.find(folder):
        return grips.rows(folder, network)
    as_asked = functools.partial(translate.translate, sensor=options.sensor, weights=options.weights)
    return slides.rows(folder, as_asked, QUICK if options.quick else None)


def on_test_set(network: Translator, options: argparse.Namespace) -> list[Row]:
    """Return rows on simulated contacts, and renew the model card if the command line's options name one."""
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


def expected(rows: Sequence[Row]) -> list[str]:
    """Return the lines of a Markdown table: errors of contacts 0.1 to 0.3 mm deep and deeper, beside baselines."""
    by_set = {(row["name"], part): row for row in rows for part in (SHALLOW, DEEP) if part in (row["set"] or "")}
    lines = [HEAD, "|---|---|---|---|---|"]
    for words, name, unit in EXPECTED:
        found = [by_set[name, part] for part in (SHALLOW, DEEP) if (name, part) in by_set]
        numbers = [number for row in found for number in (row["value"], row["baseline"])]
        shown = [short(number) + unit for number in numbers]
        lines += [f"| {words} | {' | '.join(shown)} |"] if len(found) == 2 else []
    return lines


def renew_model_card(
    page: Path, rows: list[Row], translator: Translator, pairs: Pairs, apart: Sequence[Translator] = ()
) -> None:
    """Renew the tables of the model card ``page``, and CSV and picture beside it. rows : all that was measured
    apart : networks that rows of unseen sets are about. Raises ValueError for a page without the tables."""
    conditions = [f"| {what} | {words} |" for what, words in _conditions(translator.card, pairs, apart)]
    renew_tables(page, {HEAD: expected(rows), CONDITIONS[0]: [*CONDITIONS, *conditions]})
    unseen = [each for each in rows if (each["set"] or "").startswith("unseen")]
    known = [each for each in rows if each not in unseen]
    write_table(page.with_suffix(".csv"), {"test contacts": known, "kept apart": unseen})
    atomic.write_bytes(page.with_name(PICTURE), _cases(translator, pairs))


def _conditions(card: dict, pairs: Pairs, apart: Sequence[Translator]) -> Iterator[tuple[str, str]]:
    """Yield the cells of a table, name and text, on what the networks were trained on and measured with.
    card : of the networks; apart : networks that were trained without something"""
    data, options = card["pairs"], card["options"]
    counts = ", ".join(f"{number} for {what}" for what, number in data["contacts"].items())
    total = sum(data["contacts"].values())
    yield (
        "training data",
        f"{total} simulated paired contacts ({counts}), fast tier, sha256 `{data['sha256'][:16]}...`",
    )
    yield "indenters", ", ".join(json.loads(data["indenters"]))
    latents = ", ".join(f"{name} {options[f'latent_{name.lower()}']}" for name in ("signal", "BioTac", "DIGIT"))
    yield "latents", f"{latents}; KL weight {options['beta']:g}; seed {card['seed']}; torch {card['versions']['torch']}"
    yield "test contacts", f"{len(pairs.press)} of {len(np.unique(pairs.press))} presses"
    for kept in (each.card["options"] for each in apart):
        left, below = [*kept["without"]], kept["without_below_x"]
        left += [] if below is None else [f"the pad beyond x = {1e3 * below:g} mm"]
        yield "kept apart", f"networks without {' and '.join(left)}, for {kept['effort']:g} of the usual epochs"


def _cases(translator: Translator, pairs: Pairs) -> bytes:
    """Return a PNG of the gel's true and translated depth and their difference, for the best, median, worst contact."""
    from matplotlib.figure import Figure

    nets, gel = translator.nets, sensors.digit_surface()
    change = as_read(pairs.signal, SEED)
    found = nets.decode_target(nets.likely_latents(nets.encode_signal(change))[1])
    true = true_displacement(pairs, "digit", np.arange(len(change)))
    errors, nothing = (rms_in_contact(each, true) for each in (found, 0 * true))
    share = np.where(true[..., 1].max(1) >= 1e-4, errors / nothing, np.nan)
    order = np.argsort(share)[: np.isfinite(share).sum()]
    names = pairs.indenter_names
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.subplots(3, 3)
    for row, (word, contact) in enumerate(
        zip(("best", "median", "worst"), order[[0, len(order) // 2, -1]], strict=True)
    ):
        depth = [1e3 * each[contact, :, 1] for each in (true, found, found - true)]
        peak = np.abs(depth[0]).max()
        for ax, values, title in zip(axes[row], depth, ("true", "translated", "difference"), strict=True):
            drawn = ax.tripcolor(1e3 * gel.rest[:, 2], 1e3 * gel.rest[:, 0], gel.faces, values, shading="gouraud",
                                 cmap="RdBu_r", vmin=-peak, vmax=peak)  # fmt: skip
            ax.set(aspect="equal", title=title, xlabel="z, mm")
        axes[row, 0].set_ylabel(f"{word}: {names[pairs.indenter[contact]]}\nx, mm")
        figure.colorbar(drawn, ax=axes[row], label="depth, mm")
    return png_of(figure)


if __name__ == "__main__":
    sys.exit(main())
