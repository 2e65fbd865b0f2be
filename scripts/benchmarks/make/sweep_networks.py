"""Train the networks with other latent sizes and KL weights on the same pairs, and compare them on the test contacts.

    python scripts/benchmarks/make/sweep_networks.py pairs.h5 --out out/sweep --json sweep.json

Each setting is a whole training but for the networks that are not compared; errors are those of the full tier's test
contacts that ship, nothing of which was trained on. ``published`` has the latents and the KL weight of the method's
authors (docs/sources.md).
``direct`` is trained from three seeds, the bar that the chain must reach. ``--prototype`` adds a
training on pairs of scenes/prototype, the first prototype's set, judged by test presses of its own, as that was.
Settings that are done are not trained again, so that a stopped sweep goes on. Needs torch; minutes a setting on one
core.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import finished, parser_of
from benchmarks.translation.noise import as_read
from benchmarks.translation.test_set import SEED
from tactile_core.accuracy import HEADER, Row, line
from tactile_core.errors import TactileError
from tactile_core.simulation.pairs_file import Pairs, read_pairs
from tactile_core.training.error_summary import metric_row, metric_rows
from tactile_core.training.step_errors import our_bodies, translation_metrics
from tactile_core.translation import translate

TEST_SET = Path(__file__).resolve().parents[3] / "scenes" / "training" / "test_contacts.h5"
SETTINGS: dict[str, dict[str, float]] = {
    "default": {},
    "signal 4": {"latent_signal": 4},
    "signal 16": {"latent_signal": 16},
    "mesh 16 and 32": {"latent_biotac": 16, "latent_digit": 32},
    "mesh 64 and 96": {"latent_biotac": 64, "latent_digit": 96},
    "no mirror images": {"mirrored": 0.0},
    "places astray": {"astray": 0.0},
    "neither": {"mirrored": 0.0, "astray": 0.0},
    "beta 1e-3": {"beta": 1e-3},
    "beta 1e-5": {"beta": 1e-5},
    "published": {"latent_signal": 8, "latent_biotac": 128, "latent_digit": 128, "beta": 0.005},
}
METRICS = ("MVB_rms_um", "MVD_rms_um", "M2MPN_rms_um", "S2MPN_rms_um", "chain_rms_um", "force_percent")
BASELINES = ("baseline_biotac_rms_um", "baseline_digit_rms_um")
DIRECT_SEEDS = (0, 1, 2)
NOT_COMPARED = ("back", "error")


def main(arguments: list[str] | None = None) -> int:
    """Train, compare, print and write; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("pairs", help="HDF5 file of `tactile pairs`")
    parser.add_argument("--out", type=Path, required=True, help="folder for the trainings, which are kept")
    parser.add_argument("--effort", type=float, default=1.0, help="times the usual epochs (default: 1)")
    names = [*SETTINGS, *OWN_ROWS]
    parser.add_argument("--only", action="append", choices=names, help="a setting (default: all there are pairs for)")
    parser.add_argument("--prototype", metavar="FILE", help="pairs of scenes/prototype, to train on as well")
    options = parser.parse_args(arguments)
    test, rows = read_pairs(TEST_SET), []
    print(HEADER, flush=True)
    try:
        for name in options.only or [*SETTINGS, "direct", *["prototype"] * bool(options.prototype)]:
            found = OWN_ROWS[name](options) if name in OWN_ROWS else setting_rows(name, options, test)
            rows += found
            print("\n".join(map(line, found)), flush=True)
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    return finished(rows, options.json)


def setting_rows(name: str, options: argparse.Namespace, test: Pairs) -> list[Row]:
    """Errors of one setting's networks on the test contacts."""
    folder = trained(name, 0, SETTINGS[name], ("direct", *NOT_COMPARED), options)
    nets, rows = translate.load_translator(folder / "weights").nets, np.arange(len(test.press))
    columns = translation_metrics(nets, test, rows, as_read(test.signal, SEED), our_bodies())
    return metric_rows({metric: columns[metric] for metric in (*METRICS, *BASELINES)}, test, rows, name, {})


def direct_rows(options: argparse.Namespace) -> list[Row]:
    """Errors of the direct network and of the chain on the trainings' own test presses, each seed and their mean."""
    folders = [trained(f"direct {seed}", seed, {}, NOT_COMPARED, options) for seed in DIRECT_SEEDS]
    found = []
    for metric in ("direct_rms_um", "chain_rms_um"):
        each = [own_error(folder, metric) for folder in folders]
        for seed, row in zip(DIRECT_SEEDS, each, strict=True):
            found.append(metric_row(metric, row["value"], row["baseline"], None, f"seed {seed}"))
        mean, baseline = (float(np.mean([row[key] for row in each])) for key in ("value", "baseline"))
        found.append(metric_row(metric, mean, baseline, None, "mean of seeds"))
    return found


def prototype_rows(options: argparse.Namespace) -> list[Row]:
    """Errors of a training on the prototype's set on its own test presses: the fast tier's truth, equal depths."""
    if not options.prototype:
        raise TactileError("--only prototype", "no pairs of scenes/prototype", "--prototype FILE", "`tactile pairs`")
    pairs = argparse.Namespace(**{**vars(options), "pairs": options.prototype})
    folder = trained("prototype", 0, {}, NOT_COMPARED, pairs)
    rows = [own_error(folder, metric) for metric in (*METRICS, "direct_rms_um")]
    return [{**row, "set": "the prototype's set"} for row in rows]


def own_error(folder: Path, metric: str) -> Row:
    """Metric of a training on its own test presses."""
    errors = translate.load_translator(folder / "weights").card["errors"]
    return next(row for row in errors if row["name"] == metric)


OWN_ROWS = {"direct": direct_rows, "prototype": prototype_rows}


def trained(
    name: str, seed: int, settings: dict[str, float], left_out: tuple[str, ...], options: argparse.Namespace
) -> Path:
    """The folder of a training, made unless it is there."""
    from tactile_core.training.options import Options
    from tactile_core.training.train import train

    folder = options.out / name.replace(" ", "_")
    if not (folder / "weights" / "card.json").exists():
        chosen = dataclasses.replace(Options(effort=options.effort), **settings, left_out=left_out)
        train(options.pairs, folder, seed, chosen, lambda share, text: print(f"{name}: {text}", file=sys.stderr))
    return folder


if __name__ == "__main__":
    sys.exit(main())
