"""A simulated recording reads back as a raw recording that knows its truth."""

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.mechanics.recording import simulate_recording

SHORT = """
format = "tactile-scene-1"
name = "short"
description = "One press."
[[indenters]]
kind = "sphere"
name = "ball"
radius_mm = 3.5
[recording]
indenter = "ball"
points = [
    { time_s = 0.0, x_mm = -8.0, z_mm = 0.0, force_n = 0.0 },
    { time_s = 0.4, x_mm = -8.0, z_mm = 0.0, force_n = 0.0 },
    { time_s = 0.5, x_mm = -8.0, z_mm = 2.0, force_n = 0.3 },
    { time_s = 0.6, x_mm = -8.0, z_mm = 2.0, force_n = 0.0 },
]
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SHORT, encoding="utf-8")
    return path


def test_recording_carries_its_truth(scene, tmp_path):
    out = tmp_path / "short.h5"
    simulate_recording(scene, out, seed=4)
    recording = recordings.read(out)
    assert recording.simulated and len(recording) == 61
    assert recording.about["scene"] == SHORT and "Simulated" in recording.about["note"]
    truth = recording.truth
    np.testing.assert_allclose(np.linalg.norm(truth.force[50]), 0.3, rtol=0.02)  # axial; the rest leans
    np.testing.assert_allclose(truth.contact_center[50], [-8e-3, 2e-3], atol=0.2e-3)  # half a node spacing
    assert np.isnan(truth.contact_center[:41]).all() and not truth.displacement_biotac[:41].any()
    signals = recordings.prepare(recording)
    assert signals.kind == "raw" and not signals.flags.any()
    assert np.abs(signals.change[50]).max() > 10 > 5 > np.abs(signals.change[:41]).max()
    assert recording.pdc[50] > recording.pdc[0]


def test_same_seed_same_bytes(scene, tmp_path):
    files = [tmp_path / f"{name}.h5" for name in "abc"]
    for file, seed in zip(files, (4, 4, 5), strict=True):
        simulate_recording(scene, file, seed=seed)
    assert files[0].read_bytes() == files[1].read_bytes() != files[2].read_bytes()


def test_pressing_too_hard_names_the_moment(scene, tmp_path):
    scene.write_text(SHORT.replace("force_n = 0.3", "force_n = 30.0"), encoding="utf-8")
    with pytest.raises(TactileError, match=r"0\.4\d s.*Lower force_n"):
        simulate_recording(scene, tmp_path / "x.h5")
    assert not (tmp_path / "x.h5").exists()


def test_scene_without_a_recording(request, tmp_path):
    with pytest.raises(TactileError, match="recording"):
        simulate_recording(request.config.rootpath / "scenes/press_sphere", tmp_path / "x.h5")


def test_an_existing_file_is_kept(scene, tmp_path):
    out = tmp_path / "short.h5"
    out.write_text("mine")
    with pytest.raises(TactileError, match="exists already"):
        simulate_recording(scene, out)
    assert out.read_text() == "mine"


def test_a_place_off_the_gel_names_the_point(scene, tmp_path):
    scene.write_text(SHORT.replace("z_mm = 2.0, force_n = 0.3", "z_mm = 9.5, force_n = 0.3"), encoding="utf-8")
    with pytest.raises(TactileError, match="point 3"):
        simulate_recording(scene, tmp_path / "x.h5")
