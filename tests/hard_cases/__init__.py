"""Hard cases: what is asked, of which stage, and what is expected; ``benchmarks/hard_cases.py`` prints them all."""

from . import chain, numerics, pictures, shapes, signals, sliding
from .case import CASES, HARD

__all__ = ["CASES", "HARD", "chain", "numerics", "pictures", "shapes", "signals", "sliding"]
