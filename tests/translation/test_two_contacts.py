"""Two contacts at once: told apart where they are asked for, added on skin and gel, and left alone elsewhere."""

import dataclasses
import shutil

import h5py
import numpy as np
import pytest
from conftest import SHIPPED

from tactile_core import accuracy
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.recordings import prepare
from tactile_core.recordings.flags import Flag
from tactile_core.translation import networks
from tactile_core.translation.answer import Answer
from tactile_core.translation.card import PARTS
from tactile_core.translation.networks import Networks, load
from tactile_core.translation.translate import load_translator
from tactile_core.translation.translator import Translator
from tactile_core.translation.weights import card_bytes, read_card

DOUBLE = "scenes/training/double_contacts.npz"


@pytest.fixture(scope="module")
def double(request):
    with np.load(request.config.rootpath / DOUBLE) as found:
        return {name: found[name] for name in found.files}


@pytest.fixture(scope="module")
def answers(double, shipped):
    """Both answers on the double contacts, without noise: two looked for, and one."""
    rest = prepare(shipped).at(np.zeros(len(double["signal"]), int))
    asked = dataclasses.replace(rest, change=double["signal"])
    nets = load()
    return [Translator(nets, Answer(contacts=count))(asked) for count in (2, 1)]


def test_two_balls_are_told_apart(double, answers):
    two, one = answers
    both = np.isfinite(two.second_center[:, 0])
    assert both.mean() > 0.5 and not np.isfinite(one.second_center).any() and not one.second_force.any()
    assert ((two.flags[both] & Flag.TWO_CONTACTS) > 0).all()
    places = np.stack([two.contact_center, two.second_center], axis=1)[both]
    true = double["place"][both]
    away = np.minimum(*(accuracy.lengths(places - each).mean(axis=1) for each in (true, true[:, ::-1])))
    apart = accuracy.lengths(true[:, 0] - true[:, 1])
    assert np.median(away) < 0.25 * np.median(apart)  # one place between them would be half of it away


def test_the_gel_is_nearer_to_the_truth_and_the_force_too(double, answers):
    true, force = double["displacement_digit"] * double["scale"], accuracy.lengths(double["force"])
    both = np.isfinite(answers[0].second_center[:, 0])
    left, off = [], []
    for found in answers:
        left.append(np.square(found.displacement_digit - true)[both].sum())
        total = accuracy.lengths(found.force) + accuracy.lengths(found.second_force)
        off.append(np.median(np.abs(total / force - 1)[both]))
    assert left[0] < 0.85 * left[1] and off[0] < off[1]


def test_convert_writes_a_second_contact_where_asked(tmp_path):
    for count in ("1", "2"):
        out = ["--out", str(tmp_path / count), "--frames", "60:100:5"]
        assert main(["convert", str(SHIPPED), *out, "--contacts", count]) == 0
    with (
        h5py.File(tmp_path / "1" / "press_roll_slide" / "frames.h5") as one,
        h5py.File(tmp_path / "2" / "press_roll_slide" / "frames.h5") as two,
    ):
        assert not {"second_center", "second_force"} & set(one)
        single = ~np.isfinite(two["second_center"][:, 0])
        assert single.mean() > 0.9 and two["second_force"].shape == (8, 3)  # one ball presses
        assert np.allclose(one["force"][:][single], two["force"][:][single], rtol=1e-4, atol=1e-5)


def test_what_cannot_tell_two_contacts_says_so(tmp_path, capsys):
    nets = load()
    old = Networks({net: own for net, own in nets.tensors.items() if net != PARTS}, nets.card)
    with pytest.raises(TactileError, match="single contacts alone"):
        Translator(old, Answer(contacts=2))
    asked = ["--contacts", "2", "--gel", "solved", "--out", str(tmp_path / "out")]
    assert main(["convert", str(SHIPPED), *asked]) == 2
    assert "--contacts 2" in capsys.readouterr().err
    with pytest.raises(TactileError, match="Answer, contacts: 3; expected 1 or 2"):
        Answer(contacts=3)


def test_weights_from_before_still_translate(tmp_path):
    folder = tmp_path / "weights"
    shutil.copytree(networks.WEIGHTS_FOLDER, folder, ignore=shutil.ignore_patterns("biotac_sp", f"{PARTS}.*"))
    card, _ = read_card(folder)
    del card["nets"][PARTS]
    (folder / "card.json").write_bytes(card_bytes(card))
    assert PARTS not in load_translator(folder).nets.tensors
