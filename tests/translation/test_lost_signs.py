"""Signs that rectified changes have lost: recovered where a simulated contact plainly gives such changes."""

import numpy as np
import pytest

from tactile_core.recordings.polarity import contact_signals
from tactile_core.translation.simulated_likeness import recovered


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
