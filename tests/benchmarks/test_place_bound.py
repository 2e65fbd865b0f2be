"""The least error that any estimate of a contact from its signals can have."""

import numpy as np
import pytest
from benchmarks import place_bound
from benchmarks.translation.evaluation import TEST_SET

from tactile_core.simulation.pairs_file import read_pairs

pytest.importorskip("scipy", reason="contacts are solved with scipy, of the extra [fem]")


def test_surer_readings_tell_more():
    pairs = read_pairs(TEST_SET)
    deep = np.flatnonzero(~pairs.slide.any(axis=1) & (pairs.depth_biotac >= place_bound.DEEP))[:2]
    rows = place_bound.bound_rows(pairs.select_rows(deep))
    places = [row["value"] for row in rows if row["name"] == "least_place_mm"]
    assert sorted(places, reverse=True) == places and 0 < places[-1] < places[0] < 2


def test_signals_that_tell_nothing_leave_the_prior():
    least, depth = place_bound._least(np.zeros((19, 5)), np.ones(19), np.array([0, 0, 0, 0, 1e-3]))
    draws = np.random.default_rng(1).standard_normal((100_000, 2)) * 1e3 * place_bound.PRIOR[:2]
    assert least == pytest.approx(np.median(np.hypot(*draws.T)), rel=0.06)  # four deviations of a median of 2,000
    assert depth == pytest.approx(100 * place_bound.PRIOR[4] / 1e-3)
