"""``tactile train``: train the networks on pairs."""

from __future__ import annotations

import argparse
import os
from shlex import quote

from ...errors import TactileError
from ...training.options import DEVICES
from ..terminal import bar, next_step, say, tell
from .common import RESUMES, add, check_seed

BRIEF = "train the networks on pairs, or fine-tune one"
TEXT = """\
Train the networks and the force estimate on simulated pairs. With the word s2mpn in place of the pairs, fine-tune
that one network on a real sensor's recording that says where and how hard it was touched (HDF5 with
electrode_vals/data, contact_loc/data, force_vec/data). DIR/weights then holds weights and card."""
EPILOG = """\
example:
  tactile train pairs.h5 --out trained --seed 1
  tactile convert touch.csv --out results --weights trained/weights
  tactile train s2mpn --real labelled.hdf5 --out tuned      starts from the shipped weights, or from --weights DIR

Needs torch: `tactile doctor` says how to install it. An interrupted run goes on where it stopped."""
LEAVES = RESUMES
ALIKE = {"mm": 0.5, "%": 5.0}  # baseline error up to which all labels are alike (assumed)
MAX_EFFORT = 1000.0


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("pairs", metavar="PAIRS", help="HDF5 file of `tactile pairs`, or the word s2mpn")
    verb.add_argument("--real", metavar="FILE", help="with s2mpn: the labelled recording")
    verb.add_argument("--weights", metavar="DIR", help="with s2mpn: weights to start from (default: those that ship)")
    verb.add_argument("--out", required=True, metavar="DIR", help="folder to write")
    add(verb, "--seed", same="weights")
    verb.add_argument("--effort", type=float, default=1.0, metavar="X", help="factor on all epochs (default: 1)")
    verb.add_argument("--without", action="append", default=[], metavar="NAME", help="indenter to leave out")
    verb.add_argument("--without-below-x", type=float, metavar="MM", help="leave out contacts at smaller x")
    what = "auto (default) takes a GPU if torch sees one; weights repeat to the byte only on the same device"
    verb.add_argument("--device", choices=DEVICES, default="auto", help=what)
    verb.add_argument("--overwrite", action="store_true", help="train again over older weights in DIR")
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Train or fine-tune networks; returns the exit status."""
    check_seed(options.seed)
    if options.pairs == "s2mpn":
        return _fine_tune(options)
    for name in ("real", "weights"):
        if getattr(options, name) is not None:
            raise TactileError(f"--{name}", f"beside pairs, {options.pairs}", "the word s2mpn in their place")
    if not 0 < options.effort <= MAX_EFFORT:
        raise TactileError("--effort", str(options.effort), f"above 0, at most {MAX_EFFORT}", "1 is the usual training")
    from ...training.options import Options
    from ...training.train import train

    region = None if options.without_below_x is None else 1e-3 * options.without_below_x
    chosen = Options(effort=options.effort, without=tuple(options.without), without_below_x=region)
    with bar("training", "%", options.progress) as shown:
        card = train(
            options.pairs,
            options.out,
            options.seed,
            chosen,
            lambda share, text: shown(round(100 * share), 100),
            overwrite=options.overwrite,
            device=options.device,
        )
    _say_error(card)
    tell(options.out)
    next_step(f"look at {os.path.join(options.out, 'loss.png')}, then {_convert(options.out)}")
    return 0


def _say_error(card: dict) -> None:
    """Print the weights' error on held-out presses, and a warning if it is hardly below the baseline."""
    from ...translation.card import chain_error, doubt

    found = chain_error(card)
    if found is not None:
        say(f"held-out presses: the gel is off by {found[0]:.3g} um rms; no displacement at all: {found[1]:.3g} um")
    if doubt(card):
        say(f"warning: {doubt(card)}")


def _fine_tune(options: argparse.Namespace) -> int:
    """Train S2MPN further on a labelled recording."""
    for name, usual in (("effort", 1.0), ("without", []), ("without_below_x", None), ("device", "auto")):
        if getattr(options, name) != usual:
            raise TactileError(f"--{name.replace('_', '-')}", "beside s2mpn", "--real, --weights, --out and --seed")
    if options.real is None:
        raise TactileError("--real", "none", "a recording with contact places and forces")
    from ...accuracy import HEADER, line
    from ...training.fine_tune import fine_tune
    from ...translation.weights import read_card

    with bar("fine-tuning", "%", options.progress) as shown:
        rows = fine_tune(
            options.real,
            options.out,
            options.weights,
            options.seed,
            lambda share, text: shown(round(100 * share), 100),
            options.overwrite,
        )
    for text in (HEADER, *map(line, rows)):
        tell(text)
    for text in read_card(os.path.join(options.out, "weights"))[0]["fine_tuned"]["dropped"]:
        say(f"left out: {text}")
    # Where all labels are alike, as of a rig that presses in one place, one answer is right.
    for row in (row for row in rows if row["value"] >= row["baseline"] > ALIKE[row["unit"]]):
        say(f"warning: {row['name']} of {row['set']} is no better than one answer for all: check units, frame, order")
    tell(options.out)
    next_step(_convert(options.out))
    return 0


def _convert(out: str) -> str:
    """Return the command that converts a recording with the weights of the training in the folder ``out``."""
    return f"tactile convert touch.csv --out results --weights {quote(os.path.join(out, 'weights'))}"
