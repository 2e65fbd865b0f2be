"""Batches that are broken in every way we know: the door to `benchmarks/faults.py`; `--help` says all."""

from __future__ import annotations

import sys

from benchmarks.faults import main

if __name__ == "__main__":
    sys.exit(main())
