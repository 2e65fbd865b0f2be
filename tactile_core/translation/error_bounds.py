"""Bounds on 95 of 100 largest errors: a factor on the expected error for each region.

Split conformal prediction in groups with the ratio of the errors as score (Lei et al. 2018, section 5.2; Vovk 2012).
The groups are regions along the finger in which the contact lies: with one factor for all, bounds were too wide over
the electrodes and too narrow beyond them. Results without contact are a group with the error itself as score: nearly
all are right to a micrometre, and the few that missed a light touch have no ratio to such an expectation.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import TactileError
from .network_sizes import SURFACES
from .weights import ADVICE

LEVEL = 0.95  # share of frames whose error the bound covers
EDGES = (-14e-3, -8e-3, -2e-3)  # m, x of the contact's middle: tip, first and last electrodes, base (assumed)
PLACES = len(EDGES) + 2  # results without contact first
FEWEST = 100  # contacts of a place: of fewer the 95 % quantile says little, and the factor of all counts (assumed)
KINDS = ("signed", "rectified")


def place(x: np.ndarray) -> np.ndarray:
    """Return the region's number (T,) int. x : (T,) m, contact's middle along the finger, NaN without contact."""
    return np.where(np.isnan(x), 0, 1 + np.searchsorted(EDGES, x, side="right"))


def fit(error: np.ndarray, expected: np.ndarray, x: np.ndarray) -> list[float]:
    """Fit the PLACES numbers that cover LEVEL of the contacts of each region, four digits: m, then factors.

    error, expected : (C,) m, the largest node error and what was expected of it; x : (C,) m, as in `place`
    """
    ratio, where = error / expected, place(x)
    scores = [error, *[ratio] * (PLACES - 1)]
    parts = [score[where == each] for each, score in enumerate(scores)]
    return [_quantile(part if len(part) >= FEWEST else every) for part, every in zip(parts, scores, strict=True)]


def _quantile(score: np.ndarray) -> float:
    return float(f"{np.quantile(score, min(1.0, LEVEL * (1 + 1 / len(score)))):.4g}")


def bound(expected: np.ndarray, x: np.ndarray, numbers: list[float]) -> np.ndarray:
    """Bound (T,) float32 m on 95 of 100 largest errors. expected : (T,) m; x : (T,) m, as in `place`."""
    where = place(x)
    return np.where(where == 0, numbers[0], np.asarray(numbers)[where] * expected).astype(np.float32)


def check(card: Mapping[str, object], where: str) -> None:
    """Raise TactileError unless the card has PLACES positive numbers a surface for signed and rectified signals."""
    bounds = card.get("error_bounds")
    for kind in KINDS:
        for name in SURFACES:
            kinds = bounds.get(kind) if isinstance(bounds, dict) else None
            value = kinds.get(name) if isinstance(kinds, dict) else None
            if not (isinstance(value, list) and len(value) == PLACES and all(map(_is_factor, value))):
                entry = f"{where}, error_bounds.{kind}.{name}"
                raise TactileError(entry, f"{value!r:.80}", f"{PLACES} numbers above 0, one a place", ADVICE)


def _is_factor(value: Any) -> bool:
    return type(value) in (int, float) and 0 < value < 1e6
