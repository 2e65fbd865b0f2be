"""Hold our BioTac SP against the presses of an independent COMSOL model.

    python scripts/benchmarks/compare_comsol.py FOLDER [--fast] [--json FILE]

FOLDER holds one folder a press of bsadr/biotac (docs/sources.md). Prints a table; exits 1 when a row misses its
target, 2 when a file cannot be read. Under a minute a press. Needs the extra [fem]. --fast takes
their skin in the fast tier instead, which needs the BioTac SP's table of electrodes (docs/extend.md).
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks import comsol_sensor
from benchmarks.measured_rows import finished, parser_of, printed
from benchmarks.mechanics.comsol import comsol, fast_rows, presses
from tactile_core.errors import TactileError


def main() -> int:
    """Run the checks, print and write their rows; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--fast", action="store_true", help="the fast tier, of the skin that the presses have")
    options = parser.parse_args()
    try:
        if options.fast:
            with comsol_sensor.known() as name:
                rows = printed(row for press in presses(options.folder) for row in fast_rows(press, name))
        else:
            rows = printed(comsol(options.folder))
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    return finished(rows, options.json)


if __name__ == "__main__":
    sys.exit(main())
