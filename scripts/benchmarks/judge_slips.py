"""Judge weights of a BioTac SP by the direction in which real ones slip.

    python scripts/benchmarks/judge_slips.py FOLDER --weights DIR [--json FILE]

FOLDER holds a folder a class of CSV recordings, as yayaneath/BioTacSP-DoS (docs/sources.md). Prints a table (rows:
``benchmarks.translation.slip_direction``); exits 2 when a file cannot be read. Needs scikit-learn.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import finished, parser_of, printed
from benchmarks.translation import slip_direction
from tactile_core.errors import TactileError
from tactile_core.translation.translate import load_translator


def main() -> int:
    """Run, print, write; the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--weights", metavar="DIR", required=True, help="networks of a BioTac SP")
    options = parser.parse_args()
    try:
        rows = printed(slip_direction.rows(load_translator(options.weights, source=None), options.folder))
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    return finished(rows, options.json)


if __name__ == "__main__":
    sys.exit(main())
