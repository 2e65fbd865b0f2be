"""Doubt a recording whose contacts, taken together, resemble no simulated ones.

A wrong polarity, gains, order of channels or rest turns each contact into a signal that a contact may well have: one
frame hardly shows it. What a few neighbouring simulated contacts leave unexplained, averaged over different contacts of
a recording, does (``scripts/benchmarks/translation/wrong_laws.py``; docs/accuracy.md has the table).
"""

from __future__ import annotations

import numpy as np

from ..sensors import SOURCE
from .polarity import patterns, spread_out, touching, unit

MOST = 2000  # frames looked at, evenly spread
NEIGHBOURS = 8  # simulated contacts that a change is put together from
RIDGE = 0.1  # of their unit vectors' products: neighbours are alike, and their differences must not grow without bound
BEGINNING = "signals unlike simulated contacts"  # of the warning
FEWEST = 15  # different contacts: one press and its noise are like up to a dozen, and fewer hardly show a wrong gain
# Share of a change left over, LEFT + MORE / sqrt(different contacts), that 99 of 100 recordings of units with the right
# law stay below: simulated contacts of even presses, gains 10 % apart, noise of 1.5 counts (`wrong_laws.py --fit`).
LEFT, MORE = 0.1856, 0.2076


def unexplained_share(change: np.ndarray, sensor: str = SOURCE) -> tuple[float, int]:
    """Return the mean share of changes (n, 19) counts that no simulated contact explains, and of how many contacts."""
    if not len(change):
        return 0.0, 0
    change = change[spread_out(len(change), MOST)]
    chosen = unit(change)
    known = patterns(sensor)
    like = chosen @ known.T
    near = known[np.argpartition(-like, NEIGHBOURS, axis=1)[:, :NEIGHBOURS]]
    products = near @ near.transpose(0, 2, 1) + RIDGE * np.eye(NEIGHBOURS)
    weights = np.linalg.solve(products, (near @ chosen[:, :, None]))
    left = np.sqrt(np.square(chosen - (near * weights).sum(axis=1)).sum(axis=1))
    _, which, counts = np.unique(like.argmax(axis=1), return_inverse=True, return_counts=True)
    # Where rest is far off, all contacts look like one, but for what they change by.
    steps = change - np.median(change, axis=0)
    others = np.unique((unit(steps[touching(steps)]) @ known.T).argmax(axis=1))
    return float((np.bincount(which, left) / counts).mean()), max(len(counts), len(others))


def limit(contacts: int) -> float:
    """Return the share left over beyond which a recording of so many different contacts is doubted."""
    return LEFT + MORE / float(np.sqrt(contacts))


def doubt(change: np.ndarray, sensor: str = SOURCE) -> str:
    """Say why changes in contact (n, 19) counts, of a typical unit, are doubted; empty where they are not."""
    left, contacts = unexplained_share(change, sensor)
    if contacts < FEWEST or left <= limit(contacts):
        return ""
    return (
        f"{BEGINNING}: {left:.0%} of them is left over by their neighbours among these, as a mean"
        f" of {contacts} contacts, at most {limit(contacts):.0%} of a unit as simulated. Polarity, gains, order of the"
        " electrodes or rest may be wrong: see tactile info, --polarity, --tare, and tactile adapt for gains"
    )
