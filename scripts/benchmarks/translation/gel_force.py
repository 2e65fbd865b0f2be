"""Force that a DIGIT's gel carries, as a linear functional of its surface's displacement.

The same force on both sensors is the law that contacts are translated by. What a translated gel carries, read off its
displacement alone, says how far the networks keep to it. The functional is fitted to simulated contacts
(``scripts/benchmarks/make/make_gel_force.py``): in a linear gel it would be exact; how far it is off on gels solved at
finite strain is its ceiling (docs/translation.md).
"""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

TABLE = Path(__file__).with_suffix(".npy")


@functools.cache
def functional() -> np.ndarray:
    """Forces (3 M, 3) float32 N by a metre's displacement of each coordinate of the DIGIT's M nodes."""
    return np.load(TABLE, allow_pickle=False).astype(np.float32)


def carried_force(displacement: np.ndarray) -> np.ndarray:
    """Force (T, 3) float32 N on a gel whose surface is displaced by (T, M, 3) m."""
    return np.asarray(displacement, np.float32).reshape(len(displacement), -1) @ functional()
