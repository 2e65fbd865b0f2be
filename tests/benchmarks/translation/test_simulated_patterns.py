"""The nearest simulated contact is found by direction, and by size where that is held."""

import numpy as np
import pytest
from benchmarks.translation.simulated_patterns import nearest

PATTERN = np.r_[-100.0, 40.0, np.zeros(17)]


def test_a_contact_that_is_there_is_found():
    assert nearest(PATTERN, np.stack([np.roll(PATTERN, 5), PATTERN])) == pytest.approx((1, 1))


def test_other_sizes_are_found_where_size_is_free_alone():
    free, held = nearest(PATTERN, np.stack([0.2 * PATTERN, 3 * PATTERN]))
    assert free == pytest.approx(1) and held == 0
    other = 0.8 * np.r_[-100.0, 0.0, 40.0, np.zeros(16)]
    assert nearest(PATTERN, np.stack([3 * PATTERN, other]))[1] == pytest.approx(1 / 1.16)


def test_the_wrong_sign_is_far():
    assert nearest(PATTERN, -PATTERN[None]) == (pytest.approx(-1), 0.0)
