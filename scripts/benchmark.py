"""Measure speed against error of every stage: runs `benchmarks/table/speed_error.py`, see --help."""

from __future__ import annotations

import sys

from benchmarks.table.speed_error import main

if __name__ == "__main__":
    sys.exit(main())
