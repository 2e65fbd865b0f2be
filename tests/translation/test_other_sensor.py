"""Weights of another fluid sensor: a copy of the BioTac under another name gives the same, by what its card holds."""

import dataclasses
import json
import shutil

import numpy as np
import pytest

from tactile_core import recordings, sensors
from tactile_core.errors import TactileError
from tactile_core.jobs.frames_file import described, named
from tactile_core.sensors import descriptor
from tactile_core.translation import networks, translate, translator
from tactile_core.translation.card import pair_of

NAME = "finger"


@pytest.fixture
def weights(tmp_path, monkeypatch):
    """The shipped weights, as of a sensor of one's own with the BioTac's shape."""
    shutil.copytree(descriptor.FOLDER / "biotac", tmp_path / "own" / NAME, ignore=shutil.ignore_patterns("*.py*"))
    monkeypatch.setenv(descriptor.OWN, str(tmp_path / "own"))
    folder = tmp_path / "weights"
    shutil.copytree(networks.WEIGHTS_FOLDER, folder)
    card = json.loads((folder / "card.json").read_text(encoding="utf-8"))
    card[f"{NAME}_nodes_sha256"] = card.pop("biotac_nodes_sha256")
    card["rest_counts"] = sensors.REST_COUNTS.tolist()
    (folder / "card.json").write_text(json.dumps(card), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def signals(shipped):
    return recordings.prepare(shipped).at(slice(100, 300, 20))


def test_the_same_shape_and_signals_give_the_same_by_another_name(weights, signals):
    network = translate.load_translator(weights, source=None)
    assert (network.nets.source, network.nets.target, network.nets.electrodes) == (NAME, "digit", 19)
    ours = translate.load_translator()(signals)
    theirs = network(dataclasses.replace(signals, sensor=NAME))
    for name in ("displacement_biotac", "displacement_digit", "force", "confidence", "flags"):
        np.testing.assert_array_equal(getattr(theirs, name), getattr(ours, name), err_msg=name)


def test_a_unit_that_rests_elsewhere_is_read_by_the_cards_rest(weights, signals):
    network = translate.load_translator(weights, source=None)
    card = network.nets.card | {"rest_counts": (sensors.REST_COUNTS - 300).tolist()}
    other = translator.Translator(networks.Networks(network.nets.tensors, card))
    named_so = dataclasses.replace(signals, sensor=NAME)
    # a unit at fewer counts answers more strongly
    assert np.abs(other(named_so).force[:, 1]).max() > 1.05 * np.abs(network(named_so).force[:, 1]).max()


def test_signals_and_weights_of_two_sensors_are_refused(weights, signals):
    with pytest.raises(TactileError, match="signals of a BioTac SP; expected those of a BioTac"):
        translate.load_translator(weights, source=None)(dataclasses.replace(signals, sensor="biotac_sp"))
    with pytest.raises(TactileError, match="networks of finger and digit; expected networks that translate"):
        translate.load_translator(weights)


def test_a_card_names_a_sensor_of_each_kind(weights):
    for names, words in (
        (("digit", "none_such"), "Put the folder of none_such"),
        (("biotac", NAME), "a sensor of skin and fluid, and a gel"),
    ):
        with pytest.raises(TactileError, match=words):
            pair_of({f"{name}_nodes_sha256": "" for name in names}, "card.json")
    assert pair_of({}, "card.json") == ("biotac", "digit")


def test_what_is_written_is_named_after_the_sensors(weights):
    pair = NAME, "digit"
    assert named("displacement_biotac", pair) == "displacement_finger" and named("latent_digit", pair) == "latent_digit"
    assert named("latent_digit", ("biotac", "gelsight_mini")) == "latent_gelsight_mini"
    assert described("(T, 19) E1..E19 as read", ("biotac_sp", "digit")) == "(T, 24) E1..E24 as read"
    assert described("code of the BioTac's", ("biotac", "digit")) == "code of the BioTac's"
