"""The nearest photograph, moved: a change is found again where it lies in another."""

import numpy as np
import pytest
from benchmarks.nearest_photograph import moved_onto


@pytest.mark.parametrize(("down", "right"), [(5, -7), (-3, 0), (0, 0)])
def test_a_moved_change_is_moved_back(down, right):
    change = np.zeros((40, 60, 3))
    change[15:22, 25:33] = np.random.default_rng(0).normal(0, 30, (7, 8, 3))
    onto = np.roll(change, (down, right), (0, 1))
    np.testing.assert_array_equal(moved_onto(change, onto), onto)


def test_what_leaves_the_picture_is_gone():
    change = np.zeros((40, 60, 3))
    change[:, :6] = 20.0
    onto = np.zeros_like(change)
    onto[:, :2] = 20.0
    assert moved_onto(change, onto).sum() <= change.sum()
