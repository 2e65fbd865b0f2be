"""Gains and offsets of an unknown sensor, held against simulated truth; the sensor file; the verb."""

import json
import re

import msgspec
import numpy as np
import pytest
from conftest import write_counts

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.mechanics.fast.sensing_points import electrode_feet
from tactile_core.recordings import electrode_gains, prepare, read
from tactile_core.recordings.electrode_gains import FORMAT, ElectrodeGains, SensorFile
from tactile_core.recordings.flags import Flag
from tactile_core.sensors import COUNT_SIGN, REST_COUNTS, electrodes
from tactile_core.translation import adapt, reference_signals, weights

ONES, ZEROS = [1.0] * 19, [0.0] * 19
CARD = {"format": weights.CARD_FORMAT, "polarity": "falls"}


def contacts(count: int, seed: int, places: np.ndarray | None = None) -> np.ndarray:
    """(count, 19) counts: dents of the film under a place, as much bulge around, read as one over its thickness."""
    random = np.random.default_rng(seed)
    if places is None:
        places = np.column_stack([random.uniform(-20e-3, 2e-3, count), random.uniform(-6e-3, 6e-3, count)])
    away = electrodes()[None, :, [0, 2]] - places[:, None]
    distance = np.square(away).sum(axis=-1)
    depth = random.uniform(0.05e-3, 0.8e-3, (count, 1))
    width = random.uniform(2e-3, 4e-3, (count, 1))
    dent = np.exp(-distance / (2 * width**2)) - 0.3 * np.exp(-distance / (2 * (3 * width) ** 2))
    rest = electrode_feet().gap
    return COUNT_SIGN * 0.1 * (1 / np.maximum(rest - depth * dent, 20e-6) - 1 / rest)


def readings(change: np.ndarray, gain: np.ndarray, offset: np.ndarray, rectified: bool, seed: int) -> np.ndarray:
    """What a sensor of these gains (19,) and offsets (19,) counts makes of true changes (n, 19)."""
    noise = np.random.default_rng(seed).normal(0, 1.5, change.shape)
    read = gain * change + offset + noise
    return np.floor(np.abs(read)) if rectified else np.rint(read)


def touched(change: np.ndarray) -> np.ndarray:
    return change[reference_signals.touching(change)]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def error(found: adapt.Adapted, gain: np.ndarray) -> float:
    """Scatter of the gains' error: a factor common to all cannot be said from harder presses."""
    left = np.log(found.sensor.gain) - np.log(gain)
    return rms(left - left.mean())


@pytest.fixture(scope="module")
def typical():
    return reference_signals.make(contacts(6000, seed=0))


@pytest.mark.parametrize("rectified", [False, True])
@pytest.mark.parametrize("sigma", [0.3, 0.5])
def test_gains_are_found_to_half_their_scatter(typical, rectified, sigma):
    """Null: no adaptation leaves all of the scatter. Half is asked for; on simulated pairs a third to 0.4 is left."""
    truth = touched(contacts(600, seed=1))
    for unit in range(3):
        gain = np.exp(sigma * np.random.default_rng(unit).standard_normal(19))
        read = readings(truth, gain, np.zeros(19), rectified, seed=unit)
        found = adapt.fit(read[reference_signals.touching(read)], rectified, typical, "test")
        baseline = rms(np.log(gain) - np.log(gain).mean())
        assert error(found, gain) < 0.5 * baseline
        assert found.warnings == ()


@pytest.mark.parametrize("count", [40, 600])
def test_the_gains_uncertainty_is_stated_to_half(typical, count):
    """Over units; of one unit alone it may be off by more."""
    errors, stated = [], []
    for unit in range(4):
        gain = np.exp(0.25 * np.random.default_rng(20 + unit).standard_normal(19))
        read = readings(touched(contacts(count, seed=30 + unit)), gain, np.zeros(19), False, seed=unit)
        read = np.tile(read[reference_signals.touching(read)], (2, 1))
        found = adapt.fit(read, False, typical, "test")
        errors.append(error(found, gain))
        stated.append(float(re.search(r"gains to about (\d+)%", found.sensor.note)[1]) / 100)
    assert 0.5 < rms(np.array(stated)) / rms(np.array(errors)) < 2


def test_too_few_different_contacts_give_no_gains(typical):
    one = contacts(1, seed=5, places=np.array([[-8e-3, 0.0]]))
    with pytest.raises(TactileError, match="different contacts"):
        adapt.fit(readings(np.tile(one, (100, 1)), np.ones(19), np.zeros(19), False, 0), False, typical, "test")


@pytest.mark.parametrize("rectified", [False, True])
def test_a_sensor_like_the_simulated_one_is_left_alone(typical, rectified):
    """0.1: as much as a gain error of 10 %, which the networks are trained to bear."""
    read = readings(touched(contacts(600, seed=2)), np.ones(19), np.zeros(19), rectified, seed=0)
    assert rms(np.log(adapt.fit(read, rectified, typical, "test").sensor.gain)) < 0.1


def test_offsets_are_found_where_signs_are_known(typical):
    offset = np.random.default_rng(3).normal(0, 5, 19)
    truth = touched(contacts(600, seed=1))
    found = adapt.fit(readings(truth, np.ones(19), offset, False, 0), False, typical, "test")
    assert rms(np.array(found.sensor.offset_counts) - offset) < 0.4 * rms(offset)  # baseline: 1
    folded = adapt.fit(readings(truth, np.ones(19), offset, True, 0), True, typical, "test")
    assert folded.sensor.offset_counts == ZEROS and "no offsets" in folded.sensor.note


def test_a_contact_that_lasts_counts_once(typical):
    """A hundred times the same frames must not outweigh the belief in gain 1."""
    gain = np.exp(0.5 * np.random.default_rng(0).standard_normal(19))
    one = readings(touched(contacts(60, seed=5, places=np.tile([[-8e-3, 0.0]], (60, 1)))), gain, np.zeros(19), False, 0)
    once, often = (adapt.fit(np.tile(one, (n, 1)), False, typical, "test") for n in (2, 40))
    assert once.sensor.gain == pytest.approx(often.sensor.gain, rel=0.02)  # both are thinned to other frames
    assert (np.abs(np.log(once.sensor.gain)) < np.abs(np.log(gain)).max()).all()


def test_what_the_recording_does_not_tell_stays_at_one_and_is_said(typical):
    truth = touched(contacts(200, seed=6, places=np.random.default_rng(0).normal([-18e-3, 0], 5e-4, (200, 2))))
    read = readings(truth, np.ones(19), np.zeros(19), False, 0)
    found = adapt.fit(read, False, typical, "test")
    assert 1 in found.sensor.gain and any("hardly touched" in warning for warning in found.warnings)
    read = readings(touched(contacts(400, seed=7)), np.ones(19), np.zeros(19), False, 0)
    read[:, 4] = 0  # dead
    found = adapt.fit(read, False, typical, "test")
    assert found.sensor.gain[4] == 1 and any("E5" in text for text in found.warnings)


def test_too_little_contact_is_refused(typical):
    with pytest.raises(TactileError, match="49 frames in contact"):
        adapt.fit(touched(contacts(600, seed=1))[:49], False, typical, "test")
    with pytest.raises(TactileError, match="contacts; expected at least"):
        reference_signals.make(contacts(20, seed=0))


def test_typical_signals_come_back_from_their_file(typical, tmp_path):
    entry = reference_signals.write(tmp_path, typical)
    assert entry == reference_signals.write(tmp_path, reference_signals.make(contacts(6000, seed=0)))  # the same bytes
    (tmp_path / "card.json").write_bytes(weights.card_bytes(CARD | {"signals": entry}))
    again = reference_signals.read(tmp_path)
    np.testing.assert_array_equal(again.typical, typical.typical)
    for rectified in (False, True):
        np.testing.assert_allclose(again.bias(rectified), typical.bias(rectified), atol=1e-6)  # kept as float32
    assert (tmp_path / entry["file"]).stat().st_size < 30_000
    data = bytearray((tmp_path / entry["file"]).read_bytes())
    data[-1] ^= 1
    (tmp_path / entry["file"]).write_bytes(bytes(data))
    with pytest.raises(TactileError, match="sha256"):
        reference_signals.read(tmp_path)


@pytest.mark.parametrize("entry", [None, 7, {}, {"sha256": "0"}, {"sha256": "0", "count": -1}])
def test_a_card_without_typical_signals_is_told(entry, tmp_path):
    (tmp_path / "card.json").write_bytes(weights.card_bytes(CARD | {"signals": entry}))
    with pytest.raises(TactileError, match="no typical signals"):
        reference_signals.read(tmp_path)


def write_recording(path, change: np.ndarray, kind: str) -> None:
    """A slide file of these changes with 0.5 s of rest around: "rectified", or "raw" with rest at a typical unit's."""
    quiet = np.zeros((50, 19))
    change = np.concatenate([quiet, np.repeat(change, 4, axis=0), quiet])
    random = np.random.default_rng(0)
    change = change + random.normal(0, 1, change.shape)
    electrodes = np.floor(np.abs(change)) if kind == "rectified" else np.rint(REST_COUNTS + change)
    write_counts(path, electrodes, pdc=np.pad(np.full(len(change) - 100, 50), 50))


@pytest.fixture(scope="module")
def trained(typical, tmp_path_factory):
    """A weights folder as far as `tactile adapt` looks into it."""
    folder = tmp_path_factory.mktemp("weights")
    entry = reference_signals.write(folder, typical)
    (folder / "card.json").write_bytes(weights.card_bytes(CARD | {"signals": entry}))
    return folder


@pytest.mark.parametrize("kind", ["raw", "rectified"])
def test_the_verb_writes_a_file_that_convert_can_use(kind, trained, tmp_path, capsys):
    truth = touched(contacts(200, seed=8))
    gain = np.exp(0.4 * np.random.default_rng(4).standard_normal(19))
    recording, out = tmp_path / "touch.csv", tmp_path / "sensor.toml"
    write_recording(recording, gain * truth, kind)
    assert main(["adapt", str(recording), "--out", str(out), "--weights", str(trained)]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    sensor = electrode_gains.read(out).unit
    left = np.log(sensor.gain) - np.log(gain)
    assert rms(left - left.mean()) < 0.6 * rms(np.log(gain) - np.log(gain).mean())
    assert "touch.csv" in sensor.note
    before = out.read_bytes()
    assert main(["adapt", str(recording), "--out", str(out), "--weights", str(trained)]) == 2  # never overwritten
    assert out.read_bytes() == before


def test_signed_and_rectified_recordings_do_not_mix(typical, tmp_path):
    truth = touched(contacts(100, seed=8))
    for kind in ("raw", "rectified"):
        write_recording(tmp_path / f"{kind}.csv", truth, kind)
    with pytest.raises(TactileError, match="signed and rectified"):
        adapt.adapt([tmp_path / "raw.csv", tmp_path / "rectified.csv"], typical)


def test_signals_are_corrected_and_say_so(tmp_path):
    sensor = ElectrodeGains("made up", [2.0] * 19, [3.0] * 19)
    for kind in ("raw", "rectified"):
        write_recording(tmp_path / f"{kind}.csv", touched(contacts(50, seed=8)), kind)
        signals = prepare(read(tmp_path / f"{kind}.csv"))
        found = electrode_gains.apply(signals, sensor)
        offset = 0 if kind == "rectified" else 3  # folded away with the sign
        np.testing.assert_allclose(found.typical, (signals.typical - offset) / 2, atol=1e-6)
        assert found.report["sensor"]["gain"] == [2.0] * 19 and "sensor" not in signals.report
        assert found.report["sensor"]["offset_counts"] == [offset] * 19
        assert (found.electrodes == signals.electrodes).all()
        doubt = Flag.LAW_DOUBTED  # which the unit's gains may take back, or give
        assert (found.flags | doubt == signals.flags | doubt).all()


def test_a_sensor_file_comes_back(tmp_path):
    unit = ElectrodeGains('odd "name"\n.csv', [1.25, *ONES[1:]], [-3.5, *ZEROS[1:]])
    rested = msgspec.structs.replace(unit, rest_counts=[3300.0] * 19, rest_spread_counts=ONES, rest_pdc=1000.5)
    rested = msgspec.structs.replace(rested, stiffness=1.25, stiffness_error=0.06, film=0.5)
    for sensor in (SensorFile(FORMAT, unit=unit), SensorFile(FORMAT, finger0=unit, finger3=rested)):
        electrode_gains.write(tmp_path / "sensor.toml", sensor)
        assert electrode_gains.read(tmp_path / "sensor.toml") == sensor


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": "tactile-sensor-9"}, "tactile-sensor-2"),
        ({"format": "tactile-sensor-1"}, "counts that rise where a film thins"),
        ({"gain": ONES[:18]}, "18 numbers; expected 19"),
        ({"gain": [0.0, *ONES[1:]]}, r"unit\.gain, E1: 0; expected 0.2 to 5"),
        ({"gain": [*ONES[:18], float("nan")]}, "gain, E19: nan"),
        ({"offset_counts": [1e4, *ZEROS[1:]]}, "offset_counts, E1"),
        ({"extra": 1}, "extra"),
        ({"note": 3}, "note"),
        ({"rest_counts": [5000.0, *ONES[1:]]}, r"unit\.rest_counts, E1: 5000"),
        ({"rest_pdc": -1.0}, r"unit\.rest_pdc: -1"),
        ({"stiffness": 102.0}, r"unit\.stiffness: 102; expected 0.2 to 5"),
        ({"film": 9.0}, r"unit\.film: 9; expected 0.2 to 3"),
        ({"stiffness_error": float("nan")}, r"unit\.stiffness_error: nan"),
    ],
)
def test_a_bad_sensor_file_is_refused_by_field(change, said, tmp_path):
    fields = {"note": "", "gain": ONES, "offset_counts": ZEROS, **change}
    lines = [f'format = "{fields.pop("format", FORMAT)}"', "[unit]"]
    lines += [f"{name} = {json.dumps(value).replace('NaN', 'nan')}" for name, value in fields.items()]
    text = "\n".join(lines)
    (tmp_path / "sensor.toml").write_text(text)
    with pytest.raises(TactileError, match=said):
        electrode_gains.read(tmp_path / "sensor.toml")


def test_a_file_that_is_no_sensor_file_is_refused(tmp_path):
    with pytest.raises(TactileError, match="cannot be read"):
        electrode_gains.read(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TactileError, match=r"binary\.toml"):
        electrode_gains.read(tmp_path / "binary.toml")
