"""Signals of two contacts at once are distinguished from those of one, and from those of none."""

import numpy as np
import pytest
from benchmarks.translation import grips, two_contact_rows

from tactile_core import recordings
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.polarity import contact_signals
from tactile_core.recordings.readers import each_finger
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.translation import simulated_likeness as module
from tactile_core.translation.simulated_likeness import (
    recovered,
    residual_lengths,
    residual_shares,
    two_contacts,
    unlike,
)
from tactile_core.translation.translate import load_translator
from tactile_core.translation.translator import UNTRAINED_CONFIDENCE


@pytest.fixture(scope="module")
def pairs(request):
    return read_pairs(request.config.rootpath / "scenes" / "training" / "test_contacts.h5")


def signed(count):
    return np.zeros(count, bool)


def test_two_patterns_are_two_and_each_alone_is_one():
    known = module.shipped_patterns()
    patterns, alike = known.units, known.alike
    first = 0
    second = int(alike[first].argmin())
    change = 100 * np.stack([patterns[first], patterns[second], patterns[first] + 0.7 * patterns[second]])
    assert two_contacts(residual_shares(change, signed(3))).tolist() == [False, False, True]
    one, two = residual_lengths(change[2:] / np.linalg.norm(change[2]), known)
    assert two[0] == pytest.approx(0, abs=1e-6) and one[0] > module.MORE_BY_ONE


def test_what_is_not_judged_is_not_marked():
    known = module.shipped_patterns()
    patterns, alike = known.units, known.alike
    both = patterns[0] + patterns[int(alike[0].argmin())]
    light = both * (0.9 * module.FAINT / np.linalg.norm(both))
    assert not two_contacts(residual_shares(np.stack([light, 100 * both]), np.array([False, True]))).any()
    loaded = np.stack([-light, -100 * both])
    assert not unlike(residual_shares(loaded, np.array([False, True])), loaded).any()
    assert two_contacts(residual_shares(np.empty((0, 19)), signed(0))).shape == (0,)
    # A unit that resembles no simulated one: noise as large as the signal.
    random = 100 * np.random.default_rng(0).standard_normal((50, 19))
    assert not two_contacts(residual_shares(random, signed(50))).any()
    assert unlike(residual_shares(random, signed(50)), random).all()


def test_a_change_of_conductivity_resembles_no_contact(pairs):
    known = module.shipped_patterns()
    drift = known.drift * np.array([[20.0], [-20.0], [100.0]])
    noise = 1.5 * np.random.default_rng(0).standard_normal(drift.shape)
    assert unlike(residual_shares(drift + noise, signed(3)), drift + noise).all()
    one, _, by_drift = residual_shares(pairs.signal.astype(float), signed(len(pairs.signal))).T
    assert not (one > by_drift).any()  # of simulated contacts, none


def test_far_contacts_are_found_and_single_ones_seldom_mistaken(pairs):
    found = two_contact_rows.rows(pairs)
    total, far = found[0], found[-1]
    # The patterns are made again with the weights: bounds, not the metrics measured.
    assert total["baseline"] < 0.06 < 0.2 < total["value"] < far["value"]


def test_a_translation_flags_them_and_hardly_any_of_one_contact(shipped):
    flags = load_translator()(recordings.prepare(shipped)).flags
    assert (flags & Flag.TWO_CONTACTS > 0).mean() < 0.02  # patterns go with the weights: none with those of now


def test_what_changes_under_a_rest_taken_in_contact_is_unexplained(shipped):
    translator = load_translator()
    assert not (translator(recordings.prepare(shipped)).flags & Flag.UNEXPLAINED).any()
    loaded = recordings.prepare(shipped, recordings.PrepareOptions(tare=slice(78, 83)))  # the firmest of a press
    away = np.r_[0:50, 340:360]  # frames without contact, whose changes are that press's, inverted
    wrong = translator(loaded)
    assert (wrong.flags[away] & Flag.UNEXPLAINED > 0).mean() > 0.9
    assert (wrong.confidence[away] <= UNTRAINED_CONFIDENCE).all()


def test_real_grips_are_unexplained_where_rest_was_taken_during_the_grip(outside_data):
    files = grips.hard_to_report(grips.find(outside_data("biotac_phac")))
    loaded = [recordings.prepare(recordings.read(one)) for path in files for one in each_finger(path)]
    assert len(loaded) == 8 and grips.unexplained(loaded) > 0.95


@pytest.fixture(scope="module")
def contacts():
    """Simulated contacts of 60 counts and more: a fortieth of noise turns no sign that matters."""
    patterns = contact_signals()
    return patterns[np.abs(patterns).max(1) > 60]


def test_signs_of_simulated_contacts_come_back(contacts):
    noise = np.random.default_rng(0).normal(0, 1.5, contacts.shape)
    read = np.abs(contacts + noise)
    change, rectified = recovered(read, np.ones(len(read), bool))
    assert rectified.mean() < 0.02
    right = np.sign(change) == np.sign(contacts)
    assert (read * right)[~rectified].sum() > 0.98 * read[~rectified].sum()
    np.testing.assert_allclose(np.abs(change), read)


def test_what_resembles_no_contact_is_left_as_it_is(contacts):
    """The same sizes on other electrodes, and nothing at all."""
    shuffled = np.abs(contacts)[:, np.random.default_rng(1).permutation(19)]
    for read in (shuffled, np.zeros((3, 19)), np.zeros((0, 19))):
        change, rectified = recovered(read, np.ones(len(read), bool))
        assert rectified.sum() >= 0.98 * len(read)
        np.testing.assert_allclose(change[rectified], read[rectified])


def test_signed_changes_are_not_touched(contacts):
    change, rectified = recovered(contacts, np.zeros(len(contacts), bool))
    np.testing.assert_array_equal(change, contacts)
    assert not rectified.any()
