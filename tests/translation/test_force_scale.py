"""A unit's stiffness by a measured force: found, judged on what it was not fitted to, and used."""

import json

import h5py
import msgspec
import numpy as np
import pytest
from conftest import SHIPPED

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.recordings import electrode_gains, prepare
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.translation import force_scale
from tactile_core.translation.answer import Answer
from tactile_core.translation.translate import load_translator

pytestmark = pytest.mark.usefixtures("no_sheet")

UNIT = ElectrodeGains("made up", [1.0] * 19, [0.0] * 19, stiffness=2.0, stiffness_error=0.1)
TIME = np.arange(1500) / 100
FORCE = 2 + np.sin(TIME) + 0.5 * np.sin(7 * TIME)


def fitted(translated, scale, lag=0.0):
    return force_scale.fit(translated, lambda by: scale * np.interp(TIME + by - lag, TIME, FORCE), "force.csv")


@pytest.mark.parametrize(("scale", "lag"), [(1.6, 0.0), (0.7, 0.05), (1.2, -0.2)])
def test_scale_and_lag_are_found(scale, lag):
    noise = np.exp(0.05 * np.random.default_rng(0).standard_normal(len(TIME)))
    found = fitted(noise * FORCE, scale, lag)
    assert found.scale == pytest.approx(scale, rel=0.02) and found.lag == pytest.approx(lag, abs=0.011)
    assert found.better and found.error < 0.02 and f"{found.scaled:.2f} N with this scale" in found.describe()


def test_a_scale_that_the_other_half_does_not_bear_out_is_not_written():
    """The first half is twice as stiff, the second as it is translated."""
    found = fitted(np.where(np.arange(len(TIME)) < len(TIME) // 2, FORCE / 2, FORCE), 1.0)
    assert found.scale == pytest.approx(2) and found.scaled > found.without and not found.better
    assert "no stiffness is written" in found.describe() and found.error > 0.2


def test_a_force_that_does_not_go_together_is_not_written():
    found = fitted(1 + np.random.default_rng(0).random(len(TIME)), 1.0)
    assert not found.better and "do not go together" in found.describe()


@pytest.mark.parametrize(
    ("translated", "scale", "said"), [(FORCE, 102.0, "not newtons"), (0 * FORCE, 1.0, "0 and 0 frames in contact")]
)
def test_what_no_unit_has_is_refused(translated, scale, said):
    with pytest.raises(TactileError, match=said):
        fitted(translated, scale)


def test_a_force_that_was_not_tared_is_refused():
    """At once 1 N too much, it would be a stiffness of 1.9."""
    translated = np.maximum(FORCE - 2, 0)
    assert force_scale.fit(translated, lambda by: np.interp(TIME + by, TIME, 1.2 * translated), "f.csv").better
    with pytest.raises(TactileError, match=r"f.csv: 1 N where nothing touches, .* N in contact; .*Take its reading"):
        force_scale.fit(translated, lambda by: np.interp(TIME + by, TIME, translated + 1), "f.csv")


def test_a_scale_that_pounds_would_have_is_doubted():
    for unit, doubted in ((1.0, False), (0.2248, True), (3.6, True)):
        found = force_scale.fit(FORCE, lambda by, unit=unit: unit * np.interp(TIME + by, TIME, FORCE), "f.csv")
        assert ("is the force in newtons" in found.describe()) is doubted


def test_force_and_pressure_are_scaled_and_signals_stay(shipped):
    translator = load_translator(answer=Answer(samples=3))
    signals = prepare(shipped).at(slice(60, 120))
    own = electrode_gains.apply(signals, UNIT)
    np.testing.assert_allclose(own.change, signals.change, atol=1e-9)
    plain, stiff = translator(signals), translator(own)
    assert plain.force.any()
    for name, factor in (("force", 2), ("pressure", 2), ("displacement_digit", 1)):
        np.testing.assert_allclose(getattr(stiff, name), factor * getattr(plain, name), rtol=1e-5, atol=1e-9)
    few, evidence = np.arange(60), translator.encode(signals)
    plain, stiff = (translator.plausible(evidence, few, by)["sample_force"] for by in (1.0, 2.0))
    np.testing.assert_allclose(stiff, 2 * plain)


def test_the_verb_writes_it_and_convert_and_info_say_it(tmp_path, capsys):
    """The shipped recording beside its true force, half as much again: a file of a clock of its own, late by 30 ms."""
    recording = str(SHIPPED)
    with h5py.File(recording) as file:
        time, force = file["time"][:], np.linalg.norm(file["truth/force"], axis=1)
    np.savetxt(tmp_path / "force.txt", np.column_stack([time - time[0], 1.5 * np.interp(time - 0.03, time, force)]))
    unit = str(tmp_path / "unit.toml")
    assert main(["adapt", recording, "--force", str(tmp_path / "force.txt"), "--out", unit]) == 0
    said, known = capsys.readouterr().err, electrode_gains.read(unit).sections()["unit"]
    assert known.stiffness == pytest.approx(1.5, rel=0.25)  # the networks' own error of force on one recording
    assert 0 < known.stiffness_error < 0.3 and "lag 30 ms" in said and "on the second half" in said
    assert main(["info", recording, "--sensor", unit]) == 0
    assert f"stiffness  {known.stiffness:.2f} of a typical unit's" in capsys.readouterr().out
    bare = msgspec.structs.replace(known, stiffness=None, stiffness_error=None)
    electrode_gains.write(tmp_path / "plain.toml", electrode_gains.units_file({"unit": bare}))
    stiff, plain = (converted(recording, tmp_path / out, tmp_path / f"{out}.toml") for out in ("unit", "plain"))
    assert stiff[1]["stiffness"] == known.stiffness and stiff[1]["stiffness_error"] == known.stiffness_error
    assert "stiffness" not in plain[1]
    np.testing.assert_allclose(stiff[0], known.stiffness * plain[0], rtol=1e-5)


def converted(recording, out, unit):
    """Force (10, 3) N of some frames in contact, and what the note says of the unit."""
    words = ["--frames", "70:80", "--keep", "", "--sensor", str(unit)]
    assert main(["convert", recording, "--out", str(out), *words]) == 0
    with h5py.File(out / "press_roll_slide/frames.h5") as file:
        assert file["force"][:].any()
        return file["force"][:], json.loads((out / "press_roll_slide/note.json").read_text())["prepared"]["sensor"]
