"""Weights that are hardly better than nothing are said to be; the shipped ones are not."""

import pytest

from tactile_core.translation import card, networks, weights


def card_of(value, baseline):
    rows = [{"name": "chain_rms_um", "set": "others", "value": 9.0, "baseline": 9.0}]
    return {"errors": [*rows, {"name": "chain_rms_um", "set": "test presses", "value": value, "baseline": baseline}]}


@pytest.mark.parametrize(("value", "baseline", "doubted"), [(52.1, 51.7, True), (81, 100, True), (79, 100, False)])
def test_weights_above_four_fifths_of_the_baseline_are_doubted(value, baseline, doubted):
    assert bool(card.doubt(card_of(value, baseline))) == doubted
    assert f"{value:.3g} um" in card.doubt(card_of(value, baseline)) or not doubted
    assert ("worse than none" in card.doubt(card_of(value, baseline))) == (value > baseline)


@pytest.mark.parametrize("spoiled", [{}, {"errors": 3}, {"errors": [3]}, card_of("x", 1), card_of(1, None)])
def test_cards_without_the_row_say_nothing(spoiled):
    assert card.chain_error(spoiled) is None and card.doubt(spoiled) == ""


def test_the_shipped_weights_are_not_doubted():
    shipped, _ = weights.read_card(networks.WEIGHTS_FOLDER)
    value, baseline = card.chain_error(shipped)
    assert 0 < value < 0.8 * baseline and card.doubt(shipped) == ""
