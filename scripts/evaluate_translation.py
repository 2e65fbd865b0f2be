"""The translation against truth and recordings: the door to `benchmarks/translation/evaluate.py`; `--help` says all."""

from __future__ import annotations

import sys

from benchmarks.translation.evaluate import main

if __name__ == "__main__":
    sys.exit(main())
