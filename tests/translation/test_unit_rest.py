"""A unit's rest is found among recordings that all begin and end in contact, and used where nothing calm is near it."""

import dataclasses

import numpy as np
import pytest
from benchmarks.translation.grips import in_box

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings import PrepareOptions, electrode_gains, polarity
from tactile_core.recordings.electrode_gains import FORMAT, ElectrodeGains, SensorFile, units_file
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.polarity import spread_out
from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.recording import split
from tactile_core.sensors import REST_COUNTS
from tactile_core.translation import adapt, networks, reference_signals
from tactile_core.translation.unit_rest import find_rest, read_rest

REST = np.linspace(3100.0, 3500.0, 19)
UNIT = ElectrodeGains("made", [1.0] * 19, [0.0] * 19, REST.tolist(), [5.0] * 19, 1000.0)


def held(strength: float, seed: int, *, pdc: bool = True, drift: float = 3.0) -> recordings.Recording:
    """A steady grip of a simulated contact, 2 s, by a unit whose rest drifts a little from recording to recording."""
    random = np.random.default_rng(seed)
    contacts = polarity.contact_signals()
    contact = contacts[np.argsort(np.abs(contacts).max(axis=1))[-40 + seed % 30]]
    level = REST + drift * random.standard_normal(19) + strength * contact
    pressure = 1000 + 200 * strength + random.normal(0, 0.7, 200)
    return recordings.Recording(
        name=f"grip_{seed}", path=f"grip_{seed}", layout="made", time=np.arange(200) / 100, start_time=0.0,
        electrodes=np.rint(level + random.normal(0, 1, (200, 19))), rows=np.arange(200),
        flags=np.zeros(200, np.uint16), pdc=np.rint(pressure) if pdc else None,
    )  # fmt: skip


@pytest.mark.parametrize("pdc", [True, False])
def test_it_is_that_of_the_least_pressed_recordings(pdc):
    strengths = [0.01, 0.02, 0.02, *np.linspace(0.1, 1.0, 9)]
    found = find_rest([held(strength, seed, pdc=pdc) for seed, strength in enumerate(strengths)])
    assert found.recordings == (3 if pdc else 12) and (found.pdc is None) == (not pdc)
    # What a hundredth of a grip moves, and drift of 3 counts; without pressure, what half of the contacts move.
    assert np.abs(found.counts - REST).max() < (12 if pdc else 60)
    assert (found.spread > 1).all()


def test_an_untouched_finger_s_recording_is_its_rest_and_a_pressed_one_s_is_not(tmp_path):
    noise = np.random.default_rng(0).normal(0, 2, (300, 19))
    np.savez(tmp_path / "still.npz", electrodes=np.rint(REST + noise))
    np.savez(tmp_path / "pressed.npz", electrodes=np.rint(REST + noise - np.linspace(0, 150, 300)[:, None]))
    np.savez(tmp_path / "tared.npz", electrodes=np.rint(noise))
    found = read_rest(str(tmp_path / "still.npz"))
    assert np.abs(found.counts - REST).max() < 1 and found.pdc is None and not found.recordings
    assert ((found.spread > 2) & (found.spread < 8)).all()  # half of what 98 % of the frames span, 2.3 deviations
    for name, said in (("pressed", "moves by 1[0-9]+ counts; expected an untouched finger"), ("tared", "raw counts")):
        with pytest.raises(TactileError, match=said):
            read_rest(str(tmp_path / f"{name}.npz"))


@pytest.mark.parametrize(("full", "pdc"), [(3.3, False), (1023, True), (65535, True)])
def test_rest_of_readings_in_volts_or_of_other_bits_is_in_counts(full, pdc, tmp_path):
    grips = [held(strength, seed, pdc=pdc) for seed, strength in enumerate([0.01, 0.02, 0.02, 0.5])]
    scale = full / 4095
    read = [
        dataclasses.replace(one, electrodes=scale * one.electrodes, pdc=np.rint(scale * one.pdc) if pdc else None)
        for one in grips
    ]
    found, wanted = find_rest(read), find_rest(grips)
    # Pressures of 10 bits are a fourth as fine: another window of a grip may be its least pressed.
    np.testing.assert_allclose(found.counts, wanted.counts, atol=1 if pdc else 1e-6)
    assert found.pdc == (pytest.approx(wanted.pdc, abs=4) if pdc else None)
    still = np.rint(REST + np.random.default_rng(0).normal(0, 2, (300, 19)))
    np.savez(tmp_path / "still.npz", electrodes=scale * still)
    assert np.abs(read_rest(str(tmp_path / "still.npz")).counts - REST).max() < 1


def test_too_few_and_rectified_recordings_are_refused():
    with pytest.raises(TactileError, match=r"2 recordings.*at least 3"):
        find_rest([held(0.1, 0), held(0.2, 1)])
    folded = [dataclasses.replace(held(0.3, k), electrodes=np.abs(held(0.3, k).electrodes - REST)) for k in range(3)]
    with pytest.raises(TactileError, match=r"a (rectified|scaled) recording"):
        find_rest(folded)


@pytest.mark.parametrize("stuck", [None, 0, 3300])
def test_a_rest_of_grips_alone_is_refused(stuck, tmp_path):
    contacts = polarity.contact_signals()
    firm = contacts[np.argsort(np.linalg.norm(contacts, axis=1))[-50:]]
    for k in range(3):
        counts = np.rint(REST_COUNTS + firm[10 * k] + np.random.default_rng(k).normal(0, 1, (400, 19)))
        counts[:, 4] = counts[:, 4] if stuck is None else stuck  # a faulty electrode rests at 3,622
        np.savez(tmp_path / f"{k}.npz", electrodes=counts, pdc=np.full(400, 1200.0))
    typical = reference_signals.read(networks.WEIGHTS_FOLDER)
    with pytest.raises(
        TactileError, match=r"^0, 1, 2: rest of the unit: .* a contact, which explains \d+% of.*\(--rest\)"
    ):
        adapt.adapt_hand([tmp_path / f"{k}.npz" for k in range(3)], typical)


def test_presses_of_one_place_from_rest_need_no_other_rest(tmp_path):
    contacts = polarity.contact_signals()
    firm = contacts[np.argsort(np.linalg.norm(contacts, axis=1))[-50]]
    pressed = np.interp(np.arange(400), [0, 80, 180, 400], [0, 0, 1, 0.8])[:, None]
    paths = [tmp_path / f"{k}.npz" for k in range(3)]
    for k, path in enumerate(paths):
        noise = np.random.default_rng(k).normal(0, 1, (400, 19))
        np.savez(path, electrodes=np.rint(REST_COUNTS + pressed * firm + noise))
    found, said = adapt.adapt_hand(paths, reference_signals.read(networks.WEIGHTS_FOLDER))
    assert found.unit.rest_counts is None and "no quiet part" not in " ".join(said)


def test_a_rest_that_a_grip_may_be_is_said(tmp_path):
    contacts = polarity.contact_signals()
    firm = contacts[np.argsort(np.linalg.norm(contacts, axis=1))[-50:]]
    noise, paths = np.random.default_rng(0).normal(0, 1, (400, 19)), [tmp_path / f"{k}.npz" for k in range(2)]
    for k, path in enumerate(paths):
        moves = [firm[10 * k]] * 300 + list(np.repeat(contacts[spread_out(len(contacts), 20)], 5, axis=0))
        np.savez(path, electrodes=np.rint(REST_COUNTS + np.array(moves) + noise))
    np.savez(tmp_path / "still.npz", electrodes=np.rint(REST_COUNTS + noise))
    typical = reference_signals.read(networks.WEIGHTS_FOLDER)
    said = [adapt.adapt_hand(paths, typical, None, rest)[1] for rest in (None, str(tmp_path / "still.npz"))]
    assert ["no quiet part in 0.npz" in " ".join(each) for each in said] == [True, False]


def test_a_grip_without_rest_is_measured_from_the_unit_s_own():
    grip = held(0.6, 3)
    bare, found = recordings.prepare(grip), Preparer(None, UNIT)(grip)
    assert np.abs(bare.change).max() < 10  # the grip is calm, and taken for rest
    np.testing.assert_allclose(found.change.mean(axis=0), grip.electrodes.mean(axis=0) - REST, atol=1e-6)
    assert not (found.flags & Flag.NO_QUIET_PART).any() and found.report["polarity"] == "falls"
    assert found.pdc.mean() == pytest.approx(120, abs=2)
    light = Preparer(None, UNIT)(held(0.01, 4))  # calm and near the unit's rest: its own is better
    assert light.quiet.any() and np.abs(light.change).max() < 10
    said = Preparer(PrepareOptions(tare="0:50"), UNIT)(grip)
    assert np.abs(said.change).max() < 10  # the user's own frames stand


def test_a_hand_s_file_is_read_by_finger(tmp_path):
    unit = ElectrodeGains("made", [1.0] * 19, [0.0] * 19)
    sensor = SensorFile(FORMAT, finger0=unit)
    assert sensor.gains_for("hand.mat#0", "finger0", "unit.toml") is unit
    with pytest.raises(TactileError, match=r"unit\.toml.*finger1"):
        sensor.gains_for("hand.mat#1", "finger1", "unit.toml")
    with pytest.raises(TactileError, match=r"touch.csv is of another unit.*\[unit\]"):
        sensor.gains_for("touch.csv", "unit", "unit.toml")


def test_a_bag_s_units_are_read_by_topic_and_finger(tmp_path):
    left, right = (ElectrodeGains(name, [1.0] * 19, [0.0] * 19, rest_pdc=9.0) for name in ("left", "right"))
    electrode_gains.write(
        tmp_path / "hands.toml", units_file({"left/biotac/finger0": left, "right/biotac/finger0": right})
    )
    (tmp_path / "hands.bag").touch()
    sensor = electrode_gains.read(tmp_path / "hands.toml")
    for unit in (left, right):
        path = f"{tmp_path}/hands.bag#/{unit.note}/biotac/finger0"
        assert sensor.gains_for(path, split(path).section, "hands.toml") == unit
    path = f"{tmp_path}/hands.bag#up/biotac/finger0"
    with pytest.raises(TactileError, match=r"hands.bag#up/biotac/finger0 is of another.*\[up/biotac/finger0\]"):
        sensor.gains_for(path, split(path).section, "hands.toml")


def test_real_grips_lie_where_the_fingers_are_squeezed(outside_data):
    """The place of a flat object held by two real fingers, against the electrodes it squeezes (docs/sources.md)."""
    pytest.importorskip("scipy", reason="scipy is absent: pip install tactile-core[matlab]")
    from tactile_core.translation import translate

    files = [path for path in sorted(outside_data("biotac_phac").glob("*.mat")) if path.stem.split("_")[-2] < "04"]
    hard = [path for path in files if path.name.startswith(("acrylic", "steel"))]
    soft = [path for path in files if path not in hard]
    sensor, _ = adapt.adapt_hand(soft[::3], reference_signals.read(networks.WEIGHTS_FOLDER))
    translator, shuffled = translate.load_translator(), np.random.default_rng(0).permutation(19)
    centres = {"as read": [], "shuffled": []}
    for path in hard:
        for finger in (0, 1):
            recording = recordings.read(f"{path}#{finger}")
            signals = Preparer(None, sensor.gains_for(path, f"finger{finger}", "made"))(recording)
            some = signals.at(slice(None, None, 100))
            for name, order in (("as read", slice(None)), ("shuffled", shuffled)):
                turned = {"change": some.change[:, order], "rest": signals.rest[order]}
                part = dataclasses.replace(some, **turned)
                centres[name].append(np.nanmedian(translator(part).contact_center, axis=0))
    within = {name: np.mean([in_box(place) for place in places]) for name, places in centres.items()}
    # Measured: 11 of 12; the one beside lies at z 3.5 mm.
    assert within["as read"] >= 0.9 and within["shuffled"] <= 0.2


def test_a_quiet_part_under_the_pressure_of_rest_is_kept_however_far_it_drifted():
    drifted = held(0.0, 5, drift=0.0)
    drifted = dataclasses.replace(drifted, electrodes=drifted.electrodes + 90)
    found = Preparer(None, UNIT)(drifted)
    assert found.quiet.any() and np.abs(found.change).max() < 10
    grip = Preparer(None, UNIT)(held(0.6, 3))
    assert any("rest is the unit's own: what is calm lies up to" in warning for warning in grip.warnings)


def test_pressure_of_another_zero_is_not_measured_from_the_unit_s(tmp_path):
    grip = held(0.6, 3)
    found = Preparer(None, UNIT)(dataclasses.replace(grip, pdc=grip.pdc - 1000))
    assert np.abs(found.pdc).max() < 200
    tared = [dataclasses.replace(one, pdc=one.pdc - 1000) for one in (held(s, k) for k, s in enumerate((0.01, 0.1, 1)))]
    assert find_rest(tared).pdc is None
