"""What training sees: the linear basis, the signals as read, the loss over nodes."""

import dataclasses

import numpy as np
import pytest
from small_pairs import frame, write_pairs

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.sensors import REST_COUNTS  # noqa: E402
from tactile_core.simulation.pairs_file import read_pairs, split_presses  # noqa: E402
from tactile_core.training.data import Contacts, measured  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.surface_codec import SILENT, principal_basis  # noqa: E402

OPTIONS = Options(wide_biotac=10, near_biotac=10, half_biotac=3, wide_digit=10, near_digit=10, half_digit=3, mirrored=0)
FRAMES = {"biotac": frame("biotac", 3), "digit": frame("digit", 3)}


def generator():
    return torch.Generator().manual_seed(0)


@pytest.fixture(scope="module")
def contacts(tmp_path_factory):
    path = write_pairs(tmp_path_factory.mktemp("pairs") / "pairs.h5")
    pairs = read_pairs(path)
    return Contacts(pairs, split_presses(pairs.press, 0, path), OPTIONS, FRAMES, generator())


def test_basis_is_that_of_a_singular_value_decomposition():
    rng = np.random.default_rng(0)
    data = rng.standard_normal((60, 8)) @ np.diag(0.5 ** np.arange(8)) @ rng.standard_normal((8, 90))
    fields = torch.from_numpy(data.astype(np.float32))
    basis = principal_basis(lambda rows: fields[rows], np.arange(60), 4, generator()).double().numpy()
    # float16 rounding: 2^-11 of each entry
    np.testing.assert_allclose(basis @ basis.T, np.eye(4), atol=1e-3)
    expected = np.linalg.svd(data, full_matrices=False)[2][:4]
    np.testing.assert_allclose(np.abs(basis @ expected.T), np.eye(4), atol=2e-3)


def test_basis_of_few_contacts_is_as_large_as_they_allow():
    fields = torch.from_numpy(np.random.default_rng(0).uniform(-1, 1, (5, 90)).astype(np.float32))
    basis = principal_basis(lambda rows: fields[rows], np.arange(5), 64, generator())
    assert basis.shape == (5, 90)
    torch.testing.assert_close(fields @ basis.T @ basis, fields, atol=1e-3, rtol=0)  # float16 of at most 1


def readings(true, seed):
    """(B, 19), signed."""
    return measured(true, np.random.default_rng(seed), OPTIONS)[:, :-1]


def test_readings_have_the_errors_they_should():
    true = np.zeros((4000, 19), np.float32)
    quiet = readings(true, 0)
    assert quiet.std() == pytest.approx(np.sqrt(1.5**2 + 1 / 12), rel=0.02)  # noise and rounding; 76,000 draws
    firm = readings(true + 400, 1)
    assert firm.mean() == pytest.approx(400, abs=1.0)
    assert firm.std() == pytest.approx(40, rel=0.02)
    far = readings(true + 2000, 2)
    assert (far <= 4095 - REST_COUNTS).all()  # the sensor's 12 bits end here
    assert (readings(true - 9000, 2) >= -1 - REST_COUNTS).all()


def test_a_real_unit_s_rest_is_off_and_its_gains_spread():
    true = np.zeros((4000, 19), np.float32)
    alike = dataclasses.replace(OPTIONS, misfit=0.0)
    read = [measured(true + size, np.random.default_rng(0), alike, 0.0, 1.0)[:, :-1] for size in (0, -400)]
    assert read[0].std() == pytest.approx(np.hypot(OPTIONS.unit_offset, OPTIONS.noise), rel=0.02)  # 76,000 draws
    assert np.log((read[1] - read[0]) / -400).std() == pytest.approx(OPTIONS.unit_gain, rel=0.02)


def test_a_real_unit_is_off_by_a_share_of_the_signal_s_size():
    true = np.full((4000, 19), -100, np.float32)
    alike = dataclasses.replace(OPTIONS, misfit=0.0)
    off, own = (measured(true, np.random.default_rng(0), each, 0.0, 1.0)[:, :-1] for each in (OPTIONS, alike))
    expected = OPTIONS.misfit * np.linalg.norm(true[0])
    assert np.sqrt(off.var() - own.var()) == pytest.approx(expected, rel=0.02)  # 76,000 draws


def test_rectified_readings_lose_their_sign_and_some_channels():
    true = np.full((4000, 19), 120, np.float32)  # a bulge; six times the offset's noise, a sixth of what the bits hold
    alike = dataclasses.replace(OPTIONS, misfit=0.0)
    read = measured(true, np.random.default_rng(0), alike, 0.5)
    folded = read[:, -1] == 1
    assert folded.mean() == pytest.approx(0.5, abs=0.04)  # 4,000 draws: five standard errors
    assert (read[folded, :-1] <= 0).all() and (read[~folded, :-1] > 0).all()
    missing = -read[folded, :-1] < 6 * OPTIONS.rectified_offset
    assert missing.mean() == pytest.approx(OPTIONS.rectified_missing, abs=0.01)  # 38,000 draws; whose true is 120
    size = np.log(-read[folded, :-1][~missing] / 120)
    assert size.std() == pytest.approx(OPTIONS.rectified_gain, abs=0.02)  # the widest gains meet the converter's ends


def test_a_batch_tells_the_state_of_each_contact(contacts):
    rows = np.array([0, 3, -1])
    state = contacts.batch(rows, contacts.read(rows, np.random.default_rng(0))).state.numpy()
    pairs = contacts.pairs
    np.testing.assert_array_equal(state[:2, :2], contacts.digit.place[rows[:2]])
    force = np.linalg.norm(pairs.force[rows[:2]], axis=-1)
    deepest = (pairs.displacement_digit[rows[:2]].astype(float) * pairs.scale_digit)[..., 1].max(-1)
    np.testing.assert_allclose(np.sinh(state[:2, 2:]).T, [force / 0.1, deepest / 20e-6], rtol=1e-5)
    assert not state[2].any()  # no contact


def test_silence_is_no_displacement_and_noise_alone(contacts):
    rows = contacts.with_silence(np.arange(40))
    assert (rows[-2:] == SILENT).all()
    assert len(rows) == 42
    signal = contacts.read(rows, np.random.default_rng(0))
    batch = contacts.batch(rows, signal)
    assert np.abs(signal[-2:]).max() < 10
    assert np.abs(signal[:-2]).max() > 10
    for values in (batch.biotac, batch.digit, batch.force, contacts.digit.true(rows).flatten(1)):
        assert not values[-2:].any()
        assert values[:-2].abs().amax(-1).min() > 0


def own(surface, rows):
    """Coefficients of contacts and the cells they are round."""
    return surface.modes[rows], torch.from_numpy(surface.cell[rows])


def test_loss_is_zero_for_the_truth_and_one_for_nothing(contacts):
    surface, rows = contacts.digit, contacts.split.train
    modes, cell = own(surface, rows)
    assert float(surface.loss(torch.zeros_like(modes), cell, rows)) == pytest.approx(1.0, rel=1e-3)  # 1 um floor
    # what is left is what 20 fields cannot hold
    assert float(surface.loss(modes, cell, rows)) < 0.1


@pytest.mark.parametrize("name", ["biotac", "digit"])
def test_loss_is_that_of_the_nodes(contacts, name):
    """Against the nodes themselves, round the contacts' own cells and round others."""
    surface, rows = getattr(contacts, name), contacts.split.train[:50]
    modes, cell = own(surface, rows)
    # The product of errors in both bases is left out; near fields, which fade, hold a little of the wide ones: 2.2 %.
    for shift, tolerance in ((0, 0.03), (2, 0.05)):
        there = (cell + shift).clamp(max=6)
        answer = 0.8 * modes
        squares = (surface.field(answer, there) - surface.true(rows)).square().sum((-1, -2))
        expected = (squares / surface.moving[rows] + 1e-12).sqrt().mean() / surface.baseline
        assert float(surface.loss(answer, there, rows)) == pytest.approx(float(expected), rel=tolerance)


def test_places_are_astray_by_cells_and_silence_has_none(contacts):
    surface, rows = contacts.digit, np.append(contacts.split.train[:9], SILENT)
    place = torch.from_numpy(surface.place[np.maximum(rows, 0)])
    assert float(surface.astray(place, rows)) == pytest.approx(0.01, rel=1e-4)  # what rounds it at zero
    away = place + torch.tensor([0.3, 0.4])  # five cells each
    assert float(surface.astray(away, rows)) == pytest.approx((9 * 5 + 0.01) / 10, rel=1e-4)


def test_signals_without_their_sign_tell_no_place(contacts):
    rows = np.append(contacts.split.train[:40], SILENT)
    signal = contacts.read(rows, np.random.default_rng(0), rectified=0.5)
    lost = signal[:, 19] > 0
    assert 5 < lost.sum() < 35
    batch = contacts.batch(rows, signal)
    assert (batch.signed[lost] == SILENT).all() and (batch.signed[~lost] == rows[~lost]).all()
    assert (batch.rows == rows).all()  # what they decode to is still said


def test_statistics_come_from_the_training_presses_alone(contacts):
    pairs = contacts.pairs
    changed = pairs.displacement_digit.copy()
    changed[contacts.split.test] = 12345
    other = type(pairs)(**{**vars(pairs), "displacement_digit": changed})
    again = Contacts(other, contacts.split, OPTIONS, FRAMES, generator())
    for what in ("wide", "near", "scale"):
        torch.testing.assert_close(getattr(again.digit, what), getattr(contacts.digit, what), rtol=0, atol=0)
    assert again.digit.baseline == contacts.digit.baseline
