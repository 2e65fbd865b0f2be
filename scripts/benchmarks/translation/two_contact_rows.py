"""Measure how often two contacts at once are recognised and single ones mistaken for two, and how both are translated.

To recognise, two contacts' signals are summed: far apart, each bends the skin by itself, and only the fluid couples
them. To translate, two balls were solved at once (``benchmarks/make/make_double_contacts.py``).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.table.translation_methods import plain_signals
from tactile_core.accuracy import Row, lengths, row
from tactile_core.recordings.polarity import TOUCHING
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.training.step_errors import true_displacement
from tactile_core.translation.answer import Answer
from tactile_core.translation.simulated_likeness import residual_shares, two_contacts
from tactile_core.translation.translator import Translation, Translator

from .contact_rows import left_of_nothing
from .test_set import as_read

COUNT = 2000  # of each kind; the standard error of a share of a half is .011
NEAREST, LIGHTEST = 6e-3, 1 / 3  # m between the two; share of the stronger signal that the weaker has at least
BANDS = (6e-3, 8e-3), (8e-3, 10e-3), (10e-3, 14e-3), (14e-3, np.inf)  # m
SEED = 5
DOUBLE = Path(__file__).resolve().parents[3] / "scenes" / "training" / "double_contacts.npz"
METRICS = ("split", np.mean, "1"), ("gel", np.mean, "1"), ("overlap", np.mean, "1"), ("force", np.median, "%")
HALF = 0.5  # of a field's peak: nodes that overlap (docs/accuracy.md)


def rows(pairs: Pairs) -> list[Row]:
    """Return rows of the share of double contacts that are marked as two, in all and by distance; baseline: the share
    of single contacts that are."""
    random = np.random.default_rng(SEED)
    felt = np.flatnonzero(lengths(pairs.signal) >= TOUCHING)
    single = _marked(pairs.signal[random.choice(felt, COUNT)])
    first, second, apart = pairs_apart(pairs, felt, random)
    both = _marked(pairs.signal[first] + pairs.signal[second])
    of = f"{COUNT} sums; baseline: single ones"
    found = [row("two_contacts_found", both.mean(), "1", baseline=single.mean(), of=of)]
    for least, most in BANDS:
        some = (apart >= least) & (apart < most)
        of = f"{some.sum()} sums, from {1e3 * least:g} mm" + ("" if most == np.inf else f" to {1e3 * most:g} mm apart")
        found.append(row("two_contacts_found", both[some].mean() if some.any() else None, "1", of=of))
    return found


def pairs_apart(
    pairs: Pairs, felt: np.ndarray, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw COUNT double contacts: return the first and the second one's row of pairs, and the distance, m, (COUNT,)
    each. felt : (k,), rows of pairs to draw from"""
    first, second = random.choice(felt, (2, 40 * COUNT))
    size = lengths(pairs.signal)
    apart = lengths(pairs.place[first, :2] - pairs.place[second, :2])
    alike = np.minimum(size[first], size[second]) >= LIGHTEST * np.maximum(size[first], size[second])
    good = np.flatnonzero((apart >= NEAREST) & alike)[:COUNT]
    return first[good], second[good], apart[good]


def _marked(change: np.ndarray) -> np.ndarray:
    return two_contacts(residual_shares(as_read(change, SEED), np.zeros(len(change), bool)))


def double_contacts() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Read contacts of two balls at once that ``make_double_contacts.py`` solved: signals (C, 19) counts, gels
    (C, M, 3) m, force (C,) N, of both balls."""
    with np.load(DOUBLE, allow_pickle=False) as found:
        gel = found["displacement_digit"].astype(np.float32) * np.float32(found["scale"])
        return found["signal"], gel, lengths(found["force"])


def translated_rows(network: Translator, pairs: Pairs) -> list[Row]:
    """Return rows on double and on single contacts, with two contacts looked for; baseline: with one looked for.

    split: share taken for two; gel: rms error over that of no displacement; overlap: of the nodes deeper than half the
    deepest; force: median error of both contacts' together"""
    single = pairs.signal, true_displacement(pairs, "digit", slice(None)), lengths(pairs.force)
    signal, gel, force = map(np.concatenate, zip(double_contacts(), single, strict=True))
    signals = plain_signals(as_read(signal, SEED))
    answers = (Translator(network.nets, Answer(contacts=count))(signals) for count in (2, 1))
    two, one = (_errors(answer, gel, force) for answer in answers)
    doubles = len(force) - len(pairs.force)
    found = []
    for of, part in (("two balls", slice(doubles)), ("single contacts", slice(doubles, None))):
        for name, middle, unit in METRICS:
            value, baseline = (middle(errors[name][part]) for errors in (two, one))
            found.append(row(f"two_contacts_{name}", value, unit, baseline=baseline, of=of))
    return found


def _errors(found: Translation, true: np.ndarray, force: np.ndarray) -> dict[str, np.ndarray]:
    """Return name -> (C,): whether taken for two, error and overlap of gels against ``true`` (C, M, 3) m, and error, %,
    of both forces' sum against force (C,) N."""
    size, moved = lengths(true), lengths(found.displacement_digit)
    deep, deepest = (each > HALF * each.max(1, keepdims=True) for each in (moved, size))
    both = lengths(found.force) + lengths(found.second_force)
    return {
        "split": np.isfinite(found.second_center[:, 0]),
        "gel": left_of_nothing(found.displacement_digit, true),
        "overlap": (deep & deepest).sum(1) / np.maximum((deep | deepest).sum(1), 1),
        "force": 100 * np.abs(both / force - 1),
    }
