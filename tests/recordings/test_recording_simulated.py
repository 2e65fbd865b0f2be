"""The project's own recordings: read back as written, the same bytes each time, whole or not at all."""

import os
from dataclasses import replace

import h5py
import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.errors import TactileError


def test_read_back_with_its_truth(press, simulated, tmp_path):
    arrays = simulated(press)
    path = recordings.write_simulated(tmp_path / "press.h5", **arrays)
    recording = recordings.read(path)
    assert recording.simulated and recording.name == "press" and recording.about["seed"] == 7
    assert recording.about["scene"] == arrays["scene"] and recording.about["note"] == "a made-up press"
    for name in ("displacement_biotac", "displacement_digit"):
        written, back = getattr(arrays["truth"], name), getattr(recording.truth, name)
        assert back.dtype == np.float32
        np.testing.assert_allclose(back, written, rtol=0, atol=2.51e-7)  # half of the 5e-7 m a unit, and float32
    np.testing.assert_allclose(recording.truth.contact_center, arrays["truth"].contact_center, rtol=1e-7)  # float32
    signals = recordings.prepare(recording)
    assert signals.kind == "raw" and not signals.flags.any() and signals.warnings == ()


def test_same_input_same_bytes(press, simulated, tmp_path):
    first = recordings.write_simulated(tmp_path / "a.h5", **simulated(press)).read_bytes()
    assert recordings.write_simulated(tmp_path / "b.h5", **simulated(press)).read_bytes() == first


def test_file_says_what_it_is(press, simulated, tmp_path):
    with h5py.File(recordings.write_simulated(tmp_path / "a.h5", **simulated(press))) as file:
        assert file.attrs["format"] == "tactile-recording-1" and file.attrs["simulated"]
        assert file["electrodes"].dtype == np.int16 and file["truth/displacement_biotac"].attrs["scale"] == 5e-7


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"electrodes": np.full((700, 19), 5000.0)}, "values outside 12 bits"),
        ({"electrodes": np.zeros((700, 24))}, "shape"),
        ({"pdc": np.full(700, np.nan)}, "values outside 12 bits"),
        ({"tac": np.zeros(699)}, "shape"),
    ],
)
def test_arrays_that_a_sensor_cannot_give_are_refused(change, message, press, simulated, tmp_path):
    with pytest.raises(TactileError, match=message):
        recordings.write_simulated(tmp_path / "a.h5", **(simulated(press) | change))
    assert os.listdir(tmp_path) == []


def test_truth_beyond_its_range_is_refused(press, simulated, tmp_path):
    arrays = simulated(press)
    arrays["truth"] = replace(arrays["truth"], displacement_digit=np.full((700, 9, 3), 2e-2))
    with pytest.raises(TactileError, match="beyond"):
        recordings.write_simulated(tmp_path / "a.h5", **arrays)


def test_an_interrupted_write_leaves_the_old_file(press, simulated, tmp_path, monkeypatch):
    path = recordings.write_simulated(tmp_path / "a.h5", **simulated(press))
    before = path.read_bytes()

    def stop(source, target):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        recordings.write_simulated(path, **(simulated(press) | {"seed": 8}))
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["a.h5"]


def test_damaged_truth_is_refused(press, simulated, tmp_path):
    path = recordings.write_simulated(tmp_path / "a.h5", **simulated(press))
    with h5py.File(path, "r+") as file:
        del file["truth/force"]
    with pytest.raises(TactileError, match="truth/force: this array is missing"):
        recordings.read(path)
    with h5py.File(path, "r+") as file:
        file["truth/force"] = np.zeros((700, 3))
        file["truth/displacement_digit"].attrs["scale"] = "wide"
    with pytest.raises(TactileError, match="attribute scale"):
        recordings.read(path)
