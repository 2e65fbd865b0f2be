"""Break batch jobs in every way we know: runs `benchmarks/faults.py`, see --help."""

from __future__ import annotations

import sys

from benchmarks.faults import main

if __name__ == "__main__":
    sys.exit(main())
