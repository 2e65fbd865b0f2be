"""Force that a gel carries: linear, of the right size on contacts solved at finite strain, nothing at rest."""

from pathlib import Path

import h5py
import numpy as np
from benchmarks.translation.contact_rows import carried_force

from tactile_core import accuracy, sensors
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.training.step_errors import true_displacement

CONTACTS = Path(__file__).resolve().parents[3] / "scenes" / "training" / "test_contacts.h5"


def test_it_is_linear_and_zero_at_rest():
    moved = np.random.default_rng(0).normal(0, 1e-4, (2, len(sensors.digit_surface().rest), 3))
    one, both = carried_force(moved), carried_force(moved[:1] + 2 * moved[1:])
    np.testing.assert_allclose(both[0], one[0] + 2 * one[1], rtol=1e-3, atol=1e-4)  # float32 sums of 8,601 terms
    assert not carried_force(np.zeros_like(moved)).any()


def test_gels_solved_at_finite_strain_carry_the_force_that_presses_them():
    pairs = read_pairs(CONTACTS)
    still = np.flatnonzero(~pairs.slide.any(-1))
    with h5py.File(CONTACTS) as file:
        true = file["force_digit"][()][still]
    carried = carried_force(true_displacement(pairs, "digit", still))
    ratio = accuracy.lengths(carried) / accuracy.lengths(true)
    assert np.median(np.abs(ratio - 1)) < 0.15  # 10 % measured
    assert np.median((carried * true).sum(-1) / accuracy.lengths(carried) / accuracy.lengths(true)) > 0.99
