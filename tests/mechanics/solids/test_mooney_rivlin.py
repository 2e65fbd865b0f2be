"""The Mooney-Rivlin law: exact derivatives, closed forms, and neo-Hookean where its second constant is zero."""

import numpy as np
import pytest

from tactile_core.mechanics.solids.mooney_rivlin import MooneyRivlin
from tactile_core.mechanics.solids.neo_hookean import NeoHookean

LAW = MooneyRivlin(c10=0.12e6, c01=0.03e6, bulk=1e9)


@pytest.fixture
def strained():
    random = np.random.default_rng(1)
    f = np.eye(3) + 0.2 * random.standard_normal((4, 5, 3, 3))  # J from 0.5 to 2
    return f, np.linalg.det(f), 1e5 * random.standard_normal((4, 5)), random.standard_normal((4, 5, 3, 3))


def test_stress_is_the_derivative_of_the_energy(strained):
    f, j, p, way = strained
    assert (j > 0.1).all()
    step = 1e-6
    energy = [LAW.energy(f + s * way, np.linalg.det(f + s * way)) for s in (step, -step)]
    volume = [np.linalg.det(f + s * way) for s in (step, -step)]
    slope = (energy[0] - energy[1] + p * (volume[0] - volume[1])) / (2 * step)
    stress, _ = LAW.stress_tangent(f, j, p)
    # central difference: step^2 and round-off over step, of the shear modulus
    np.testing.assert_allclose(np.einsum("...ij,...ij->...", stress, way), slope, rtol=1e-7, atol=1e-7 * 0.3e6)


def test_tangent_is_the_derivative_of_the_stress(strained):
    f, j, p, way = strained
    step = 1e-6
    ahead, behind = (LAW.stress_tangent(f + s * way, np.linalg.det(f + s * way), p)[0] for s in (step, -step))
    _, tangent = LAW.stress_tangent(f, j, p)
    found = np.einsum("...iJkL,...kL->...iJ", tangent, way)
    np.testing.assert_allclose(found, (ahead - behind) / (2 * step), rtol=1e-7, atol=1e-7 * 0.3e6)
    np.testing.assert_allclose(tangent, np.einsum("...iJkL->...kLiJ", tangent), atol=1e-12 * np.abs(tangent).max())


def test_without_its_second_constant_it_is_neo_hookean(strained):
    f, j, p, _ = strained
    one, other = MooneyRivlin(0.2e6, 0.0, 1e9), NeoHookean(0.4e6, 1e9)
    np.testing.assert_allclose(one.energy(f, j), other.energy(f, j), rtol=1e-12)
    for mine, theirs in zip(one.stress_tangent(f, j, p), other.stress_tangent(f, j, p), strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("stretch", [0.6, 1.3, 2.0])
def test_uniaxial_stress_of_the_textbook(stretch):
    """P = 2 (lambda - lambda^-2) (C10 + C01 / lambda) of an incompressible bar (Holzapfel, 2000, section 6.5)."""
    f = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    free, _ = LAW.stress_tangent(f, np.array(1.0), np.array(0.0))
    pressure = -free[1, 1] * f[1, 1]  # p J F^-T that leaves the sides without load
    stress, _ = LAW.stress_tangent(f, np.array(1.0), np.array(pressure))
    expected = 2 * (stretch - stretch**-2) * (LAW.c10 + LAW.c01 / stretch)
    np.testing.assert_allclose(stress, np.diag([expected, 0, 0]), atol=1e-10 * abs(expected) + 1e-6)  # round-off


def test_simple_shear_stress_of_the_textbook():
    """sigma_12 = 2 (C10 + C01) gamma, sigma_11 - sigma_22 = that times gamma (Holzapfel, 2000)."""
    gamma = 0.7
    f = np.eye(3)
    f[0, 1] = gamma
    first, _ = LAW.stress_tangent(f, np.array(1.0), np.array(0.0))
    cauchy = first @ f.T
    shear = 2 * (LAW.c10 + LAW.c01)
    assert cauchy[0, 1] == pytest.approx(shear * gamma, rel=1e-12)
    assert cauchy[1, 0] == pytest.approx(shear * gamma, rel=1e-12)
    assert cauchy[0, 0] - cauchy[1, 1] == pytest.approx(shear * gamma**2, rel=1e-12)


def test_turning_the_body_turns_the_stress(strained):
    f, j, p, _ = strained
    turn, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))
    turn *= np.linalg.det(turn)
    stress, _ = LAW.stress_tangent(f, j, p)
    turned, _ = LAW.stress_tangent(turn @ f, j, p)
    np.testing.assert_allclose(turned, turn @ stress, atol=1e-12 * np.abs(stress).max())  # round-off
