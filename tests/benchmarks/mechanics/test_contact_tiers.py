"""Errors of the tiers by depth, and the fast tier on contacts that the full tier solved."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.mechanics.contact_tiers import SENSORS, Miss, by_depth, fast_misses, miss, solved
from benchmarks.mechanics.random_contacts import random_contacts

from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.simulation.scene import load_scene

TRAINING = Path(__file__).parents[3] / "scenes" / "training"


def test_a_miss_is_told_in_metres_and_shares():
    true = np.zeros((4, 3))
    true[0, 1], true[1, 1] = 100e-6, 5e-6  # the second moves less than counts
    found = true + np.array([0.0, 3e-6, 4e-6])
    said = miss(7, 0.2, found, 1.1, true, 1.0)
    assert (said.press, said.share) == (7, 0.2)
    assert said.shape == pytest.approx(5e-6) and said.baseline == pytest.approx(100e-6)
    assert said.force == pytest.approx(0.1)


def test_bins_hold_what_lies_in_them():
    found = by_depth([Miss(i, 0.01 * i, 1e-6 * i, 1e-3 * i, 1e-4) for i in range(1, 21)], (0.1, 0.2, 0.3))
    assert [(each["depth_share_to"], each["contacts"]) for each in found] == [(0.1, 10), (0.2, 10)]
    assert found[0]["shape_um"] == 5.5 and found[1]["force"] == 0.0155  # medians of 1..10 and 11..20
    assert found[0]["shape_95_um"] == pytest.approx(9.55)


@pytest.mark.parametrize("sensor", SENSORS)
def test_the_fast_tier_is_near_the_full_one_on_test_contacts(sensor):
    pairs, (scene, _) = read_pairs(TRAINING / "test_contacts.h5"), load_scene(TRAINING)
    # a ball, a cylinder, and one that slides
    pairs = pairs.select_rows(np.flatnonzero(np.isin(pairs.press, (1, 3, 4))))
    found = list(fast_misses(sensor, pairs, scene))
    assert len(found) == len(pairs.press)
    # A wrong pose, depth or order of the contacts would leave errors like those of no contact at all.
    assert np.median([each.shape / each.baseline for each in found]) < 0.25
    assert max(each.share for each in found) <= 0.6


def test_a_random_contact_is_solved_as_deep_as_drawn():
    *_, contact = random_contacts(2, 3)
    found, share, seconds = solved("digit", contact, "fast")
    assert found.converged and share == pytest.approx(contact.depth / 0.5 * 0.6, rel=2e-3) and seconds > 0
