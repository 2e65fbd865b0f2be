"""Measure how many of two contacts at once are recognised, on sums of two signals, and how many single ones mistaken.

A sum stands for both at once: contacts far apart bend the skin each for itself, but for the fluid that both press.
"""

from __future__ import annotations

import numpy as np

from tactile_core.accuracy import Row, lengths, row
from tactile_core.recordings.polarity import TOUCHING
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.translation.simulated_likeness import residual_shares, two_contacts

from .test_set import as_read

COUNT = 2000  # of each kind; the standard error of a share of a half is .011
NEAREST, LIGHTEST = 6e-3, 1 / 3  # m between the two; share of the stronger signal that the weaker has at least
BANDS = (6e-3, 8e-3), (8e-3, 10e-3), (10e-3, 14e-3), (14e-3, np.inf)  # m
SEED = 5


def rows(pairs: Pairs) -> list[Row]:
    """Shares that are marked, by how far two contacts are apart; baseline: single contacts marked as well."""
    random = np.random.default_rng(SEED)
    felt = np.flatnonzero(lengths(pairs.signal) >= TOUCHING)
    single = _marked(pairs.signal[random.choice(felt, COUNT)])
    first, second, apart = pairs_apart(pairs, felt, random)
    both = _marked(pairs.signal[first] + pairs.signal[second])
    found = [
        row("two_contacts_found", both.mean(), "1", baseline=single.mean(), of=f"{COUNT} sums; baseline: single ones")
    ]
    for least, most in BANDS:
        some = (apart >= least) & (apart < most)
        of = f"{some.sum()} sums, from {1e3 * least:g} mm" + ("" if most == np.inf else f" to {1e3 * most:g} mm apart")
        found.append(row("two_contacts_found", both[some].mean() if some.any() else None, "1", of=of))
    return found


def pairs_apart(
    pairs: Pairs, felt: np.ndarray, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw rows (COUNT,) of a first and a second contact out of ``felt``, and how far they are apart, m."""
    first, second = random.choice(felt, (2, 40 * COUNT))
    size = lengths(pairs.signal)
    apart = lengths(pairs.place[first, :2] - pairs.place[second, :2])
    alike = np.minimum(size[first], size[second]) >= LIGHTEST * np.maximum(size[first], size[second])
    good = np.flatnonzero((apart >= NEAREST) & alike)[:COUNT]
    return first[good], second[good], apart[good]


def _marked(change: np.ndarray) -> np.ndarray:
    return two_contacts(residual_shares(as_read(change, SEED), np.zeros(len(change), bool)))
