"""The weights that ship are made by the code that ships: their card says so."""

import json

import pytest

from tactile_core.sensors.fluid_sensor import FALLS
from tactile_core.translation import networks
from tactile_core.translation.weights import read_card


@pytest.fixture(scope="module")
def card():
    return read_card(networks.WEIGHTS_FOLDER)[0]


def test_its_options_are_todays_defaults(card):
    options = pytest.importorskip("tactile_core.training.options").Options()
    assert card["options"] == options.settings()


def test_its_pairs_are_those_of_the_document(card, request):
    """`tactile pairs scenes/training --count 50000 --seed 0` and `tactile train --seed 0`, of docs/train.md."""
    scene = (request.config.rootpath / "scenes/training/scene.toml").read_text(encoding="utf-8")
    pairs = card["pairs"]
    assert pairs["scene"] == scene and pairs["seed"] == "0" and card["seed"] == 0
    assert sum(pairs["contacts"].values()) == 50_000 and pairs["electrodes"] == "sheet" and card["polarity"] == FALLS
    about = json.loads((request.config.rootpath / "scenes/training/pairs.card.json").read_text(encoding="utf-8"))
    assert about["contacts"] == 50_000 and about["scene"] == scene and len(pairs["sha256"]) == 64
    document = (request.config.rootpath / "docs/train.md").read_text(encoding="utf-8")
    assert "tactile pairs scenes/training --count 50000 --seed 0 --out pairs.h5" in document
    assert "tactile train pairs.h5 --out trained --seed 0" in document
