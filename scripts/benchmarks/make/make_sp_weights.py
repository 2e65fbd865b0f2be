"""Train the networks that ship for a BioTac SP: smaller than the BioTac's, so that they take less than 8 MB.

    TACTILE_SENSORS=own tactile pairs scenes/training --count 10000 --seed 3 --from biotac_sp --to digit --out sp.h5
    TACTILE_SENSORS=own python scripts/benchmarks/make/make_sp_weights.py sp.h5 --out sp

own/biotac_sp/ holds the table of electrodes (docs/extend.md). Five minutes of CPU; sp/weights then goes to
tactile_core/data/weights/biotac_sp, where the card's `doubt` is kept. Needs torch.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tactile_core.training.options import Options
from tactile_core.training.train import train

SIZES = Options(width=176, near_biotac=96, near_digit=128, wide_digit=48)


def main() -> int:
    """Train; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", metavar="PAIRS", help="HDF5 file of `tactile pairs`")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    train(options.pairs, options.out, 0, SIZES, overwrite=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
