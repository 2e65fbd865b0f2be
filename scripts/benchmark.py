"""Speed against error of every stage: the door to `benchmarks/table/speed_error.py`; `--help` says all."""

from __future__ import annotations

import sys

from benchmarks.table.speed_error import main

if __name__ == "__main__":
    sys.exit(main())
