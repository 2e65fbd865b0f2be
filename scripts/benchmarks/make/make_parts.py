"""Train the network that tells two contacts apart, on pairs of any body, and put it beside the weights that ship.

    tactile pairs SCENE --count 80000 --seed 0 --out pairs.h5     a scene with random_bodies = 0.5
    python scripts/benchmarks/make/make_parts.py pairs.h5

Eight minutes of CPU. Prints the card's new sha256, which `networks.SHIPPED_CARD_SHA256` must be.
"""

from __future__ import annotations

import argparse
import sys

import h5py
import numpy as np

from tactile_core.files.provenance import sha256
from tactile_core.mechanics.electrodes.biotac_sheet import rest_counts
from tactile_core.sensors import SOURCE
from tactile_core.simulation.pairs_file import split_presses
from tactile_core.training.export_weights import write_net
from tactile_core.training.options import Options
from tactile_core.training.train import deterministic
from tactile_core.training.two_contacts import Presses, parts_sizes, train_parts
from tactile_core.translation import networks, weights
from tactile_core.translation.card import PARTS


def main() -> int:
    """Train the network that separates two contacts on a file of pairs, and write its weights; returns the status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", metavar="PAIRS", help="HDF5 file of `tactile pairs`")
    path, folder, options = parser.parse_args().pairs, networks.WEIGHTS_FOLDER, Options()
    with h5py.File(path) as file:
        force = np.linalg.norm(file["force"][:], axis=1)
        presses = Presses(file["signal"][:], file["place"][:, :2], force)
        split = split_presses(file["press"][:], 0, path)
    rest = rest_counts(SOURCE)
    with deterministic():
        tensors = train_parts(presses, split, options, rest, SOURCE, 0, lambda share, text: print(text, flush=True))
    card, _ = weights.read_card(folder)
    card["nets"][PARTS] = write_net(folder, PARTS, tensors, parts_sizes(len(rest))) | {"pairs_sha256": sha256(path)}
    card["options"]["parts_steps"] = options.parts_steps
    weights.write_bytes(folder / weights.CARD_NAME, weights.card_bytes(card))
    print(weights.read_card(folder)[1])
    return 0


if __name__ == "__main__":
    sys.exit(main())
