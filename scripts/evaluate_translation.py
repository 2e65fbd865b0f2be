"""Compare the translation with truth and recordings: runs `benchmarks/translation/evaluation.py`, see --help."""

from __future__ import annotations

import sys

from benchmarks.translation.evaluation import main

if __name__ == "__main__":
    sys.exit(main())
