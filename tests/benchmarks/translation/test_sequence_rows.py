"""Rows of the test set of sequences."""

import dataclasses

import numpy as np
import pytest
from benchmarks.translation import sequence_rows

from tactile_core import sensors
from tactile_core.translation.translate import load_translator


@pytest.fixture(scope="module")
def truth():
    return sequence_rows.read()


def test_the_set_holds_presses_rolls_and_slides_that_begin_and_end_at_rest(truth):
    assert len(truth["signal"]) >= 60 and np.bincount(truth["motion"]).min() >= 20
    assert (truth["force"][:, [0, -1]] == 0).all() and (truth["signal"][:, [0, -1]] == 0).all()
    touched = truth["force"] > 0
    assert np.array_equal(touched, truth["patch"].any(axis=2))
    # Forces are found to a thousandth along the motion; friction turns the rest.
    assert truth["force"].max(axis=1).min() > 0.19
    moved = np.nanmax(truth["center"], axis=1) - np.nanmin(truth["center"], axis=1)
    still, slid = (np.median(np.hypot(*moved[truth["motion"] == kind].T)) for kind in (0, 2))
    assert slid > still


def test_the_truth_itself_has_no_error(truth):
    one = {name: values[0] for name, values in truth.items()}
    count, nodes = len(one["force"]), len(sensors.digit_surface().rest)
    gel = np.zeros((count, nodes, 3), np.float32)
    gel[:, 0, 1] = one["peak"]
    force = np.stack([0 * one["force"], one["force"], 0 * one["force"]], axis=1)
    found = load_translator()(sequence_rows.plain_signals(one["signal"].astype(np.float32)))
    said = dataclasses.replace(found, displacement_digit=gel, force=force, contact_center=one["center"])
    errors = sequence_rows.judged(said, one)
    assert len(errors["place"]) == (one["force"] > sequence_rows.TOUCHED).sum()
    for name in ("place", "force", "peak"):
        np.testing.assert_allclose(errors[name], 0, atol=1e-4)  # float32


def test_a_lost_contact_is_far(truth):
    one = {name: values[0] for name, values in truth.items()}
    found = load_translator()(sequence_rows.plain_signals(np.zeros((len(one["force"]), 19), np.float32)))
    assert np.isinf(sequence_rows.judged(found, one)["place"]).all()


def test_rows_are_of_some_sequences_or_all():
    found = sequence_rows.rows(load_translator(), every=10)
    whole = {row["name"]: row for row in found if "6 sequences" in row["set"]}
    names = {f"sequence_{rest}{metric}" for metric in sequence_rows.UNITS for rest in ("", "rest_off_")}
    assert set(whole) == names
    assert all(whole[name]["value"] > 0 for name in whole)
    assert whole["sequence_place"]["value"] < whole["sequence_place"]["baseline"]  # each frame alone


def test_a_unit_whose_rest_is_off_keeps_its_gains_and_noise(truth):
    right, off = (
        sequence_rows.read_by_a_unit(truth["signal"][0], np.random.default_rng(1), counts) for counts in (0.0, 3.0)
    )
    apart = off - right
    np.testing.assert_allclose(apart, np.broadcast_to(apart[0], apart.shape), atol=1e-4)
    assert 1.0 < np.abs(apart[0]).max() <= 3.0


def test_lost_contacts_have_no_median():
    assert sequence_rows.median(np.array([1.0, np.inf, np.inf])) is None
    assert sequence_rows.median(np.array([1.0, 2.0, np.inf])) == 2.0
