"""Judge weights of a BioTac SP by the direction in which real ones slip.

    python scripts/benchmarks/judge_slips.py FOLDER --weights DIR [--json FILE]

FOLDER holds a folder a class of CSV recordings, as yayaneath/BioTacSP-DoS (docs/sources.md). Prints a table (rows:
``benchmarks.translation.slip_direction``); exits 2 when a file cannot be read. Needs scikit-learn.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.translation import slip_direction
from tactile_core.errors import TactileError
from tactile_core.files import atomic
from tactile_core.translation.translate import load_translator


def main() -> int:
    """Run, print, write; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--weights", metavar="DIR", required=True, help="networks of a BioTac SP")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows here")
    options = parser.parse_args()
    rows = []
    try:
        for found in slip_direction.rows(load_translator(options.weights, source=None), options.folder):
            rows.append(found)
            print(f"| {found['name']} | {found['value']:.3f} | {found['baseline']:.3f} |", flush=True)
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    if options.json:
        atomic.write_json(options.json, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
