"""The shipped networks, end to end, against the truth that the shipped recording carries."""

import dataclasses
import json
import shutil

import numpy as np
import pytest

from tactile_core import accuracy, recordings, sensors
from tactile_core.errors import TactileError
from tactile_core.recordings.flags import Flag
from tactile_core.sensors import unrolling
from tactile_core.translation import card as cards
from tactile_core.translation import contact_frame, networks, translate
from tactile_core.translation.gel_place import elsewhere
from tactile_core.translation.posterior import Posterior
from tactile_core.translation.translator import UNTRAINED, UNTRAINED_CONFIDENCE, Translator


@pytest.fixture(scope="module")
def translator():
    return translate.load_translator()


@pytest.fixture(scope="module")
def signals(shipped):
    return recordings.prepare(shipped)


@pytest.fixture(scope="module")
def translation(translator, signals):
    return translator(signals)


def touched(shipped):
    return np.linalg.norm(shipped.truth.force, axis=1) > 0.1


def test_shapes_units_and_finite(shipped, translation):
    count = len(shipped)
    assert translation.displacement_biotac.shape == (count, *sensors.biotac_surface().rest.shape)
    assert translation.displacement_digit.shape == (count, *sensors.digit_surface().rest.shape)
    latents = "latent_signal", "latent_biotac", "latent_digit"
    for name in (*latents, "displacement_biotac", "displacement_digit", "force"):
        values = getattr(translation, name)
        assert values.dtype == np.float32 and np.isfinite(values).all() and len(values) == count
    assert (translation.confidence >= 0).all() and (translation.confidence <= 1).all()


@pytest.mark.parametrize(
    # The share of the baseline's error that is left, on a recording the training never saw. Loose: what is tested is
    # that networks, surfaces and recording belong together; the errors themselves stand in the card.
    ("field", "share"),
    [("displacement_biotac", 0.35), ("displacement_digit", 0.75)],
)
def test_displacements_are_much_nearer_the_truth_than_nothing(shipped, translation, field, share):
    here = touched(shipped)
    true = getattr(shipped.truth, field)[here]
    error = np.nanmean(accuracy.rms_in_contact(getattr(translation, field)[here], true))
    baseline = np.nanmean(accuracy.rms_in_contact(np.zeros_like(true), true))
    assert error < share * baseline


def test_force_and_place_follow_the_truth(shipped, translation):
    here = touched(shipped)
    force = np.linalg.norm(translation.force[here], axis=1)
    true = np.linalg.norm(shipped.truth.force[here], axis=1)
    assert np.median(np.abs(force - true) / true) < 0.25
    apart = np.linalg.norm(translation.contact_center[here] - shipped.truth.contact_center[here], axis=1)
    # The first and last frames of a touch may be lost.
    assert np.nanmedian(apart) < 1.5e-3 and np.isfinite(apart).mean() > 0.9


def test_the_normal_is_the_skins_at_the_true_place(shipped, translation):
    assert np.array_equal(np.isnan(translation.contact_normal[:, 0]), np.isnan(translation.contact_center[:, 0]))
    here = touched(shipped) & np.isfinite(translation.contact_center[:, 0])
    found = translation.contact_normal[here]
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, rtol=1e-5)
    true = -np.array([unrolling.roll_up(place)[1] for place in shipped.truth.contact_center[here]])

    def off(normals):
        return np.median(np.degrees(np.arccos(np.clip((normals * true).sum(1), -1, 1))))

    constant = true.mean(0) / np.linalg.norm(true.mean(0))
    force = translation.force[here] / np.linalg.norm(translation.force[here], axis=1, keepdims=True)
    assert off(found) < 3 and off(found) < 0.5 * min(off(constant), off(force))  # measured 1.9, 4.8, 5.5 degrees


def test_silence_stays_silent(shipped, translation):
    quiet = np.linalg.norm(shipped.truth.force, axis=1) == 0
    assert np.isnan(translation.contact_center[quiet, 0]).mean() > 0.9
    untouched = np.isnan(translation.contact_center[:, 0])
    still = ~translation.displacement_digit.any((1, 2))
    assert still[quiet].mean() > 0.9 and not still[touched(shipped)].any()
    for values in (translation.displacement_biotac, translation.force, translation.pressure):
        assert not values[still & untouched].any()


def test_a_frame_does_not_depend_on_its_neighbours(translator, signals, translation):
    few = [100, 80, 200]
    part = {name: getattr(signals, name)[few] for name in ("change", "electrodes", "quiet", "flags", "pdc")}
    alone = translator(dataclasses.replace(signals, **part))
    # networks.py states bit equality where the BLAS does not split work otherwise, and 1e-5 relative everywhere
    scale = np.abs(translation.displacement_digit).max()
    np.testing.assert_allclose(alone.displacement_digit, translation.displacement_digit[few], atol=1e-5 * scale)


def test_confidence_is_high_where_trained_and_low_elsewhere(translator, shipped, signals, translation):
    assert np.median(translation.confidence[touched(shipped)]) > 0.8
    assert not (translation.flags[touched(shipped)] & Flag.OUT_OF_RANGE).any()
    strange = dataclasses.replace(signals, change=np.random.default_rng(0).permuted(20 * signals.change, axis=1))
    odd = translator(strange)
    assert np.median(odd.confidence[touched(shipped)]) == 0
    assert (odd.flags[touched(shipped)] & Flag.OUT_OF_RANGE).mean() > 0.9
    restless = dataclasses.replace(signals, flags=signals.flags | np.uint16(Flag.NO_QUIET_PART))
    assert translator(restless).confidence.max() <= np.float32(UNTRAINED_CONFIDENCE)


def test_a_contact_that_is_tracked_through_silence_may_be_all_wrong(translator, shipped, signals, translation):
    """The networks' error is that of their own answer, no contact."""
    rows, deepest = np.flatnonzero(signals.quiet)[:3], np.linalg.norm(shipped.truth.force, axis=1).argmax()
    here = signals.at(rows)
    state = np.tile(translator.encode(signals.at(np.array([deepest]))).likely, (len(rows), 1))
    held = translator.decode(here, translator.encode(here), state)
    for name in ("biotac", "digit"):
        dent = accuracy.lengths(getattr(held, f"displacement_{name}")).max(axis=1).astype(np.float32)
        assert (dent > 1e-4).all() and (getattr(held, f"expected_error_{name}") >= dent).all()
        assert (getattr(translation, f"expected_error_{name}")[rows] < 0.5 * dent).all()


def test_confidence_has_the_order_of_what_is_explained(translator, shipped, signals):
    gains = np.random.default_rng(0).uniform(0.7, 1.1, 19)
    odd = translator(dataclasses.replace(signals, change=gains * signals.change))
    near = touched(shipped) & np.isfinite(odd.explained) & ((odd.flags & np.uint16(UNTRAINED)) == 0)
    near &= odd.confidence > 0.7  # no distance counts
    order = np.argsort(odd.explained[near])
    assert near.sum() > 20 and (np.diff(odd.confidence[near][order]) >= 0).all()


def test_rectified_signals_are_read_as_such(translator, shipped, signals, translation):
    """Without their sign the place is worse than with it, as expected, and better than taken for signed."""
    here = touched(shipped)
    folded = dataclasses.replace(signals, change=np.abs(signals.change))
    unsigned = translator(dataclasses.replace(folded, flags=signals.flags | np.uint16(Flag.RECTIFIED)))
    fooled = translator(folded)
    true = shipped.truth.contact_center[here]
    signed, rectified, wrong = (
        np.nanmedian(np.linalg.norm(each.contact_center[here] - true, axis=1))
        for each in (translation, unsigned, fooled)
    )
    assert signed < rectified < wrong
    assert np.median(unsigned.expected_error_biotac[here]) > np.median(translation.expected_error_biotac[here])


def test_errors_are_expected_where_they_are(shipped, translation):
    here = touched(shipped)
    for name in cards.SURFACES:
        found, true = (getattr(each, f"displacement_{name}")[here] for each in (translation, shipped.truth))
        error = accuracy.max_error(found, true)
        bound, expected = (getattr(translation, f"{what}_{name}")[here] for what in ("error_bound", "expected_error"))
        assert (bound > expected).all() and (expected > 0).all()
        # one recording of one ball is no random draw of contacts: the stated 95 % cannot be asked of it
        assert (error <= bound).mean() > 0.7


def test_a_contact_beyond_the_gel_is_flagged(translator):
    rolled = translator._unrolled
    moved = np.zeros((3, *sensors.biotac_surface().rest.shape), np.float32)
    for frame, place in enumerate([(-8e-3, 0.0), (-8e-3, 10.9e-3), (9e-3, 0.0)]):
        near = np.linalg.norm(rolled - place, axis=1) < 1.5e-3
        moved[frame, near] = [0, 5e-4, 0]
    assert translator._beyond_digit(moved).tolist() == [False, True, True]


def test_a_place_is_undecided_by_what_lies_elsewhere(translator):
    frame = translator.nets.frames["MVD"]
    rows = frame.rows - 1
    mean = np.zeros((3, 2, cards.STATE), np.float32)
    mean[..., cards.PLACE] = 3.0  # in contact
    mean[1:, 1, 0] = 0.25 * rows / contact_frame.PLACE_UNIT  # a quarter of the gel's length away
    mean[2, 1, cards.PLACE] = 0.0  # no contact at all lies nowhere else
    weight = np.tile(np.float32([0.6, 0.4]), (3, 1))
    posterior = Posterior(weight, mean, np.full_like(mean, 0.1))
    np.testing.assert_allclose(elsewhere(posterior, posterior.likely, frame), [0.0, 0.4, 0.0])


def test_weights_for_another_surface_are_refused(monkeypatch):
    monkeypatch.setattr(sensors, "sensor_surface", lambda name: sensors.biotac_surface())
    with pytest.raises(TactileError, match="digit_nodes_sha256"):
        translate.load_translator()


def test_weights_of_another_pair_of_sensors_are_refused(request, monkeypatch):
    monkeypatch.setenv("TACTILE_SENSORS", str(request.config.rootpath / "scenes/sensors"))
    for target, words in (
        ("flat_gel", "networks of biotac and digit; expected networks that translate to flat_gel"),
        ("gelsight", "'gelsight'; expected biotac, biotac_sp, digit, flat_gel, gelsight_mini"),
        ("biotac", "kind fluid; expected a sensor of kind gel"),
    ):
        with pytest.raises(TactileError, match=words):
            translate.load_translator(target=target)
    translate.load_translator(target="digit")


def test_a_changed_card_is_refused(tmp_path):
    folder = tmp_path / "weights"
    shutil.copytree(networks.WEIGHTS_FOLDER, folder)
    card = json.loads((folder / "card.json").read_text(encoding="utf-8"))

    def load(**changes):
        (folder / "card.json").write_text(json.dumps(card | changes), encoding="utf-8")
        return translate.load_translator(folder)

    assert load().card == card
    distance = card["distance"]
    signed = distance["signed"]
    for changes, said in [
        ({"distance": None}, "distance.signed.levels"),
        ({"silence": {}}, "silence.levels"),
        ({"distance": distance | {"levels": []}}, "distance.signed.levels"),
        ({"distance": distance | {"rectified": 1}}, "distance.rectified.mahalanobis"),
        ({"distance": distance | {"signed": signed | {"largest": "many"}}}, "distance.signed.largest"),
        (
            {"distance": distance | {"signed": signed | {"residual": signed["residual"][:2]}}},
            "distance.signed.residual",
        ),
        ({"distance": distance | {"signed": signed | {"residual": [float("nan")] * 5}}}, "distance.signed.residual"),
        ({"silence": card["silence"] | {"levels": [10**400]}}, "silence.levels"),
        ({"distance": distance | {"signed": signed | {"residual": [10**400] * 5}}}, "distance.signed.residual"),
        ({"nets": card["nets"] | {"M2MPN": card["nets"]["M2MPN"] | {"sizes": {"blocks": 10**9}}}}, "M2MPN"),
    ]:
        with pytest.raises(TactileError, match=said):
            load(**changes)


def test_weights_worse_than_none_give_no_confidence(translator, signals, translation):
    nets = translator.nets
    found = Translator(networks.Networks(nets.tensors, worse_than_none(nets.card)))(signals)
    assert translation.confidence.max() > 0.9
    assert 0 < found.confidence.max() <= np.float32(UNTRAINED_CONFIDENCE)


def worse_than_none(card):
    """A card whose chain is off by more than no displacement at all."""
    row = {"name": "chain_rms_um", "set": "test presses", "value": 52.1, "baseline": 51.7}
    return card | {"errors": [row]}


def test_the_shipped_card_is_pinned(monkeypatch):
    monkeypatch.setattr(networks, "SHIPPED_CARD_SHA256", "0" * 64)
    with pytest.raises(TactileError, match="sha256"):
        translate.load_translator()
