"""Signals of two contacts at once are told from those of one."""

import numpy as np
import pytest
from benchmarks.translation import two_contact_rows

from tactile_core import recordings
from tactile_core.recordings.flags import Flag
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.translation import two_contacts as module
from tactile_core.translation.translate import load_translator
from tactile_core.translation.two_contacts import left, two_contacts


@pytest.fixture(scope="module")
def pairs(request):
    return read_pairs(request.config.rootpath / "scenes" / "training" / "test_contacts.h5")


def signed(count):
    return np.zeros(count, bool)


def test_two_patterns_are_two_and_each_alone_is_one():
    patterns, alike = module._patterns()
    first = 0
    second = int(alike[first].argmin())
    change = 100 * np.stack([patterns[first], patterns[second], patterns[first] + 0.7 * patterns[second]])
    assert two_contacts(change, signed(3)).tolist() == [False, False, True]
    one, two = left(change[2:] / np.linalg.norm(change[2]))
    assert two[0] == pytest.approx(0, abs=1e-6) and one[0] > module.MORE_BY_ONE


def test_what_is_not_judged_is_not_marked():
    patterns, alike = module._patterns()
    both = patterns[0] + patterns[int(alike[0].argmin())]
    light = both * (0.9 * module.TOUCHING / np.linalg.norm(both))
    assert not two_contacts(np.stack([light, 100 * both]), np.array([False, True])).any()
    assert two_contacts(np.empty((0, 19)), signed(0)).shape == (0,)
    # A unit that resembles no simulated one: noise as large as the signal.
    random = np.random.default_rng(0).standard_normal((50, 19))
    assert not two_contacts(100 * random, signed(50)).any()


def test_far_contacts_are_found_and_single_ones_seldom_mistaken(pairs):
    found = two_contact_rows.rows(pairs)
    total, far = found[0], found[-1]
    # The patterns are made anew with the weights: bounds, not the figures measured.
    assert total["null"] < 0.06 < 0.2 < total["value"] < far["value"]


def test_a_translation_flags_them_and_hardly_any_of_one_contact(request):
    recording = recordings.read(request.config.rootpath / "scenes/press_roll_slide/press_roll_slide.h5")
    signals = recordings.prepare(recording)
    flags = load_translator()(signals).flags
    assert (flags & Flag.TWO_CONTACTS > 0).mean() < 0.02  # patterns go with the weights: none with those of now
