"""Contact mechanics against known answers: the door to `benchmarks/mechanics/validate.py`; `--help` says all."""

from __future__ import annotations

import sys

from benchmarks.mechanics.validate import main

if __name__ == "__main__":
    sys.exit(main())
