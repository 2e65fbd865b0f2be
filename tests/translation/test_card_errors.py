"""Weights that are hardly better than nothing are said to be; the shipped ones are not."""

import pytest

from tactile_core.translation import card_errors, networks, weights


def card(value, baseline):
    rows = [{"name": "chain_rms_um", "set": "others", "value": 9.0, "baseline": 9.0}]
    return {"errors": [*rows, {"name": "chain_rms_um", "set": "test presses", "value": value, "baseline": baseline}]}


@pytest.mark.parametrize(("value", "baseline", "doubted"), [(52.1, 51.7, True), (81, 100, True), (79, 100, False)])
def test_weights_above_four_fifths_of_the_baseline_are_doubted(value, baseline, doubted):
    assert bool(card_errors.doubt(card(value, baseline))) == doubted
    assert f"{value:.3g} um" in card_errors.doubt(card(value, baseline)) or not doubted
    assert ("worse than none" in card_errors.doubt(card(value, baseline))) == (value > baseline)


@pytest.mark.parametrize("spoiled", [{}, {"errors": 3}, {"errors": [3]}, card("x", 1), card(1, None)])
def test_cards_without_the_row_say_nothing(spoiled):
    assert card_errors.chain_error(spoiled) is None and card_errors.doubt(spoiled) == ""


def test_the_shipped_weights_are_not_doubted():
    shipped, _ = weights.read_card(networks.WEIGHTS_FOLDER)
    value, baseline = card_errors.chain_error(shipped)
    assert 0 < value < 0.8 * baseline and card_errors.doubt(shipped) == ""
