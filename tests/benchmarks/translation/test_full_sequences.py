"""Presses of the full tier, strung together through time."""

import numpy as np
import pytest
from benchmarks.make.make_sequences import HOLD, REST, RISE
from benchmarks.translation import full_sequences
from benchmarks.translation.evaluation import TEST_SET

from tactile_core.simulation.pairs_file import read_pairs


@pytest.fixture(scope="module")
def pairs():
    every = read_pairs(TEST_SET)
    return every.select_rows(np.flatnonzero(every.press % 12 < 5))  # the fifth of twelve slides


@pytest.fixture(scope="module")
def played(pairs):
    return full_sequences.sequences(pairs)


def test_a_press_holds_its_deepest_contact(pairs, played):
    contacts, held = full_sequences.described(pairs), range(REST + RISE - 1, REST + RISE + HOLD)
    still = [number for number, rows in enumerate(full_sequences.presses(pairs)) if not pairs.slide[rows].any()]
    assert still
    for number in still:
        deepest = full_sequences.presses(pairs)[number][-1]
        for name in ("signal", "force", "center", "peak_squared", "patch"):
            values = played[name][number, held]
            np.testing.assert_allclose(values, np.broadcast_to(contacts[name][deepest], values.shape), rtol=1e-6)


def test_a_slide_ends_at_its_last_contact(pairs, played):
    contacts, rows = full_sequences.described(pairs), full_sequences.presses(pairs)
    slid = [number for number, each in enumerate(rows) if pairs.slide[each].any()]
    assert slid
    for number in slid:
        end = played["center"][number, REST + RISE - 1 + HOLD]
        np.testing.assert_allclose(end, contacts["center"][rows[number][-1]], rtol=1e-6)


def test_nothing_touches_before_and_after(played):
    touched = played["force"] > 0
    assert np.array_equal(touched, np.isfinite(played["center"]).all(axis=2))
    assert np.array_equal(touched, played["patch"].any(axis=2))
    assert not touched[:, [0, -1]].any() and touched[:, REST + RISE].all()
    assert (np.diff(played["force"][:, REST - 1 : REST + RISE], axis=1) > 0).all()


def test_interpolation_between_contacts_misses_little(pairs):
    missed = full_sequences.left_by_interpolation(pairs)
    assert missed["place_mm"] < 0.1 and missed["signal_%"] < 12 and missed["peak_%"] < 3
