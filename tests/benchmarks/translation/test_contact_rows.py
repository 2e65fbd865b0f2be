"""Rows of the answered contact and of the posterior: a posterior that is true is said so, one that boasts is not."""

import types

import numpy as np
import pytest
from benchmarks.translation import contact_rows

from tactile_core.translation.posterior import Posterior

CONTACTS = 400


@pytest.fixture
def posterior():
    """Two components a contact, a third and two thirds."""
    rng = np.random.default_rng(0)
    mean = rng.uniform(-1, 1, (CONTACTS, 2, 4)).astype(np.float32)
    weight = np.tile(np.float32([1 / 3, 2 / 3]), (CONTACTS, 1))
    return Posterior(weight, mean, np.full_like(mean, 0.2))


def rows_of(posterior, true, monkeypatch):
    """name -> row, where contacts truly lie at ``true``."""
    monkeypatch.setattr(contact_rows, "_true_place", lambda nets, pairs: true)
    nets = types.SimpleNamespace(posterior=lambda latent: posterior, encode_signal=lambda change: change)
    return {row["name"]: row for row in contact_rows.posterior_rows(nets, None, np.zeros((CONTACTS, 19)))}


def test_draws_have_the_mixture_s_moments(posterior):
    drawn = contact_rows.draw_places(posterior, 2000, np.random.default_rng(1))
    expected = (posterior.weight[..., None] * posterior.mean).sum(1)[:, :2]
    # components at most 2 apart: standard error of the mean of 2,000 draws below .025; 800 numbers, five of them
    np.testing.assert_allclose(drawn.mean(0), expected, atol=0.125)


def test_a_true_posterior_is_told_from_one_that_boasts(posterior, monkeypatch):
    true = contact_rows.draw_places(posterior, 1, np.random.default_rng(2))[0]
    rows = rows_of(posterior, true, monkeypatch)
    shares = [rows[f"place_in_{share}_percent_region"] for share in (50, 90)]
    # 400 contacts: standard errors of .025 and .015, three of them
    assert shares[0]["value"] == pytest.approx(0.5, abs=0.075) and shares[1]["value"] == pytest.approx(0.9, abs=0.045)
    boasting = Posterior(posterior.weight, posterior.mean, posterior.spread / 4)
    assert rows_of(boasting, true, monkeypatch)["place_in_90_percent_region"]["ok"] is False


def test_the_nearest_example_is_of_another_press_and_as_strong_as_the_signal():
    signal = np.array([[100.0, 0], [98.0, 2], [0.0, 50]])
    gel = np.zeros((3, 4, 3), np.int16)
    gel[:, :, 1] = [[1], [2], [3]]
    force = np.array([[0, 1.0, 0], [0, 2.0, 0], [0, 3.0, 0]])
    pairs = types.SimpleNamespace(
        signal=signal, press=np.array([0, 0, 1]), displacement_digit=gel, scale_digit=1e-6, force=force
    )
    moved, load = contact_rows.nearest_example(pairs, 2 * signal, pairs.press)
    factor = 200 / 50  # the first signal's size over that of the only contact of another press
    assert load[0] == pytest.approx(factor * 3)
    np.testing.assert_allclose(moved[0, :, 1], factor * 3e-6, rtol=1e-5)


def test_of_a_field_that_is_right_nothing_is_left_and_of_none_all():
    true = np.zeros((3, 5, 3))
    true[:, :3, 1] = [[4.0, 2, 0.3]]  # the third node is below a tenth of the peak, and does not count
    found = true * np.array([1.0, 0, 0.5])[:, None, None]
    found[:, 2] = 9
    np.testing.assert_allclose(contact_rows.left_of_nothing(found, true), [0, 1, 0.5])
