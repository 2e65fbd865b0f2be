"""Hold our BioTac SP against the presses of an independent COMSOL model.

    python scripts/benchmarks/compare_comsol.py FOLDER [--fast] [--json FILE]

FOLDER holds one folder a press of bsadr/biotac (docs/sources.md). Prints a table; exits 1 when a row misses its
target, 2 when a file cannot be read. Under a minute a press. Needs the extra [fem]. --fast takes the sensor
``biotac_sp`` in the fast tier instead, which needs its table of electrodes (docs/extend.md).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.mechanics.comsol import comsol, fast_rows, presses
from tactile_core.accuracy import failed
from tactile_core.errors import TactileError
from tactile_core.files import atomic


def main() -> int:
    """Run the checks, print and write their rows; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows here")
    parser.add_argument("--fast", action="store_true", help="the fast tier of the sensor biotac_sp")
    options = parser.parse_args()
    rows = []
    try:
        fast = (row for press in presses(options.folder) for row in fast_rows(press))
        for found in fast if options.fast else comsol(options.folder):
            rows.append(found)
            cells = [found[key] for key in ("name", "value", "unit", "target", "baseline", "set", "ok")]
            print("| " + " | ".join("" if cell is None else str(cell) for cell in cells) + " |", flush=True)
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    if options.json:
        atomic.write_json(options.json, rows)
    return int(bool(failed(rows)))


if __name__ == "__main__":
    sys.exit(main())
