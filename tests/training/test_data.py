"""What training sees: the linear basis, the signals as read, the loss over nodes."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.training.basis import coefficients, principal_basis  # noqa: E402
from tactile_core.training.data import PARTS, SILENT, Contacts, measured  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.pairs import read_pairs, split_presses  # noqa: E402

OPTIONS = Options(modes_biotac=20, modes_digit=20)


def generator():
    return torch.Generator().manual_seed(0)


@pytest.fixture(scope="module")
def contacts(make_pairs, tmp_path_factory):
    path = make_pairs(tmp_path_factory.mktemp("pairs") / "pairs.h5")
    pairs = read_pairs(path)
    return Contacts(pairs, split_presses(pairs.press, 0, path), OPTIONS, generator())


def test_basis_is_that_of_a_singular_value_decomposition():
    rng = np.random.default_rng(0)
    data = rng.standard_normal((60, 8)) @ np.diag(0.5 ** np.arange(8)) @ rng.standard_normal((8, 90)) * 3000
    data = np.round(data).astype(np.int16).reshape(60, 30, 3)
    basis = principal_basis(data, 1e-7, np.arange(60), 4, generator()).double().numpy()
    # float16 rounding: 2^-11 of each entry
    np.testing.assert_allclose(basis @ basis.T, np.eye(4), atol=1e-3)
    expected = np.linalg.svd(data.reshape(60, -1).astype(float), full_matrices=False)[2][:4]
    np.testing.assert_allclose(np.abs(basis @ expected.T), np.eye(4), atol=2e-3)


def test_basis_of_few_contacts_is_as_large_as_they_allow():
    data = np.random.default_rng(0).integers(-100, 100, (5, 30, 3)).astype(np.int16)
    basis = principal_basis(data, 1e-7, np.arange(5), 64, generator())
    assert basis.shape == (5, 90)
    back = coefficients(data, 1e-7, basis) @ basis
    np.testing.assert_allclose(back, data.reshape(5, -1) * 1e-7, atol=1e-3 * 1e-5)  # float16 of at most 1e-5 m


def test_readings_have_the_errors_they_should():
    true = np.zeros((4000, 19), np.float32)
    quiet = measured(true, np.random.default_rng(0), OPTIONS)
    assert quiet.std() == pytest.approx(np.sqrt(1.5**2 + 1 / 12), rel=0.02)  # noise and rounding; 76,000 draws
    firm = measured(true + 400, np.random.default_rng(1), OPTIONS)
    assert firm.mean() == pytest.approx(400, abs=1.0)
    assert firm.std() == pytest.approx(40, rel=0.02)
    far = measured(true + 2000, np.random.default_rng(2), OPTIONS)
    assert far.max() <= 4095 - 3300  # the sensor's 12 bits end here
    assert measured(true - 9000, np.random.default_rng(2), OPTIONS).min() >= -3301


def test_silence_is_no_displacement_and_noise_alone(contacts):
    rows = contacts.with_silence(np.arange(40))
    assert (rows[-2:] == SILENT).all()
    assert len(rows) == 42
    change = contacts.read(rows, np.random.default_rng(0))
    batch = contacts.batch(rows, change, 1)
    assert np.abs(change[-2:]).max() < 10
    assert np.abs(change[:-2]).max() > 10
    for values in (batch.biotac, batch.digit, batch.force, contacts.digit.true(rows, 1).flatten(1)):
        assert not values[-2:].any()
        assert values[:-2].abs().amax(-1).min() > 0


def test_loss_is_zero_for_the_truth_and_one_for_nothing(contacts):
    surface, rows = contacts.digit, contacts.split.train
    nothing = [float(surface.loss(torch.zeros_like(surface.inputs(rows)), rows, part)) for part in range(PARTS)]
    assert np.mean(nothing) == pytest.approx(1.0, rel=1e-4)  # float32
    # what is left is what 20 modes cannot hold, see the card's basis rows
    assert float(surface.loss(surface.inputs(rows), rows, 0)) < 0.1


def test_statistics_come_from_the_training_presses_alone(contacts, make_pairs, tmp_path):
    pairs = contacts.pairs
    changed = pairs.displacement_digit.copy()
    changed[contacts.split.test] = 12345
    again = Contacts(
        type(pairs)(**{**vars(pairs), "displacement_digit": changed}), contacts.split, OPTIONS, generator()
    )
    torch.testing.assert_close(again.digit.basis, contacts.digit.basis, rtol=0, atol=0)
    assert again.digit.unit == contacts.digit.unit
    assert again.digit.null == contacts.digit.null
