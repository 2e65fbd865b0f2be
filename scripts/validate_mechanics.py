"""Compare contact mechanics with known answers: runs `benchmarks/mechanics/validate.py`, see --help."""

from __future__ import annotations

import sys

from benchmarks.mechanics.validate import main

if __name__ == "__main__":
    sys.exit(main())
