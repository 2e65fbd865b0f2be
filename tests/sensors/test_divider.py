"""Counts of a divider: what a unit's rest makes of a change, both ways."""

import numpy as np
import pytest

from tactile_core.sensors import COUNT_MAX, REST_COUNTS, divider

REST = np.linspace(3000.0, 3700.0, 19)


@pytest.mark.parametrize("read", [divider.reading, divider.of_films])
def test_counts_fall_as_impedance_grows_and_never_leave_the_converter(read):
    counts = read(np.array([1e-9, 0.5, 1.0, 2.0, 1e9])[:, None], REST)
    assert (np.diff(counts, axis=0) < 0).all() and counts.min() >= 0 and counts.max() <= COUNT_MAX
    np.testing.assert_allclose(counts[2], REST)


def test_units_turn_into_the_typical_one_and_back():
    change = np.random.default_rng(0).uniform(-800, 80, (20, 19))
    np.testing.assert_allclose(divider.typical(divider.of_unit(change, REST), REST), change, atol=1e-6)
    np.testing.assert_allclose(divider.typical(change, REST_COUNTS), change, atol=1e-6)
    small = divider.typical(np.full((1, 19), -1.0), REST)[0]  # near rest: by E^2 of the film's impedance
    slope, typical = (rest**2 * divider.film_impedance(rest) for rest in (REST, REST_COUNTS))
    np.testing.assert_allclose(small, -typical / slope, rtol=1e-2)


def test_noise_of_dead_and_saturated_electrodes_is_not_blown_up():
    for rest in (0.0, 1.0, 4094.0, 4095.0):
        assert np.abs(divider.typical(np.array([-1.0, 0.0, 1.0])[:, None] * np.ones(19), np.full(19, rest))).max() < 5


def test_films_turn_into_typical_ones_and_a_fluid_into_that_at_rest():
    change = np.random.default_rng(0).uniform(-800, 80, (20, 19))
    np.testing.assert_allclose(divider.of_typical_film(change, REST, 1.0), change, atol=1e-6)
    still, moved = divider.film_impedance(REST), 0.3  # of a typical film's thickness, by which the skin moves
    typical, thin = (change_of(still, 1 / (1 - part)) for part in (moved, moved / 0.5))
    np.testing.assert_allclose(divider.of_typical_film(thin, REST, 0.5), typical, atol=1e-6)
    warm = change_of(still, 1 / 1.2)
    assert np.abs(divider.of_typical_film(warm, REST, 1.0, 1.2)).max() < 1e-6
    assert np.isfinite(divider.of_typical_film(np.full((1, 19), -4000.0), REST, 3.0)).all()


def change_of(still, growth):
    """Change (19,) counts from REST as films' impedances (19,) grow by a factor."""
    series = COUNT_MAX / REST - 1 - still
    return COUNT_MAX / (1 + series + still * growth) - REST
