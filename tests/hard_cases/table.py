"""All hard cases, in the order of the table."""

from __future__ import annotations

from . import chain, numerics, pictures, shapes, signals, sliding
from .case import CASES

GROUPS = (shapes, sliding, numerics, chain, signals, pictures)  # imported for the cases that they add

# The difficulties that were set out from, each of which must be in the table.
HARD = (
    "near-incompressible gel", "indentation beyond 60 % of the thickness", "sharp edges and corners",
    "ring and concave contact", "sliding and rolling", "contact at the pad's rim and leaving it",
    "indenter much smaller than an element", "tiny force (1e-6 N)", "tiny depth (0.1 um)", "zero contact",
    "two patches at once", "load step ten times too large", "coarse and fine meshes", "inverted start",
    "saturated electrodes", "dead electrodes", "12-bit quantisation", "drift over an hour", "out-of-range latents",
    "single precision against double", "extreme px/mm", "grazing light", "depth discontinuities",
    "one-frame recordings",
)  # fmt: skip


def covered() -> set[str]:
    """The hard cases that at least one function looks at."""
    return {case.hard for case in CASES}
