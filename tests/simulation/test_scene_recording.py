"""A simulated recording reads back as a raw recording that knows its truth."""

import re

import numpy as np
import pytest
from ball_scene import ball_scene

from tactile_core import recordings, sensors
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.mechanics.node_areas import node_areas
from tactile_core.recordings import info
from tactile_core.recordings.simulated import read_truth
from tactile_core.sensors import PRESSURE_PER_COUNT
from tactile_core.simulation import scene_recording as recording_room
from tactile_core.simulation.scene_recording import PRESSURE_AT_REST, pdc_counts, simulate_recording

SHORT = ball_scene((0.0, -8.0, 0.0, 0.0), (0.4, -8.0, 0.0, 0.0), (0.5, -8.0, 2.0, 0.3), (0.6, -8.0, 2.0, 0.0))


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SHORT, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def seed_4(tmp_path_factory):
    """A simulated recording of the scene."""
    folder = tmp_path_factory.mktemp("seed_4")
    (folder / "scene.toml").write_text(SHORT, encoding="utf-8")
    simulate_recording(folder, folder / "short.h5", seed=4)
    return folder / "short.h5"


@pytest.fixture
def asked(monkeypatch):
    """What the solver is asked for, (sensor, force, tier); the fast tier answers, test_solve.py has the others."""
    solve, found = recording_room.solve, []

    def fast(sensor, *where, force, tier, friction):
        found.append((sensor, force, tier))
        return solve(sensor, *where, force=force, tier="fast", friction=friction)

    monkeypatch.setattr(recording_room, "solve", fast)
    return found


def test_recording_carries_its_truth(seed_4):
    recording = recordings.read(seed_4)
    assert recording.simulated and len(recording) == 61
    assert recording.about["scene"] == SHORT and "Simulated" in recording.about["note"]
    truth = recording.truth
    np.testing.assert_allclose(np.linalg.norm(truth.force[50]), 0.3, rtol=0.02)  # axial; the rest leans
    np.testing.assert_allclose(truth.contact_center[50], [-8e-3, 2e-3], atol=0.2e-3)  # half a node spacing
    assert np.isnan(truth.contact_center[:41]).all() and not truth.displacement_biotac[:41].any()
    signals = recordings.prepare(recording)
    assert signals.kind == "raw" and not signals.flags.any()
    assert np.abs(signals.change[50]).max() > 10 > 5 > np.abs(signals.change[:41]).max()
    pressure = recording.pdc * PRESSURE_PER_COUNT
    np.testing.assert_allclose(pressure[:41], PRESSURE_AT_REST, atol=PRESSURE_PER_COUNT / 2)
    assert pressure[50] > PRESSURE_AT_REST + 5 * PRESSURE_PER_COUNT
    low, high = re.search(r"Fluid pressure ([\d.]+) to ([\d.]+) kPa", recording.about["note"]).groups()
    assert float(low) == 1.75
    assert float(high) == pytest.approx(pressure.max() / 1e3, abs=0.018)  # half a PDC count and half a printed digit


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
def test_tractions_add_up_to_the_force(sensor, scene, seed_4, tmp_path):
    simulate_recording(scene, tmp_path / "x.h5", keep=(f"traction_{sensor}",))
    _, truth = read_truth(tmp_path / "x.h5")
    traction = truth.tractions.pop(sensor)
    assert traction.dtype == np.float32 and traction.shape == (61, len(sensors.sensor_surface(sensor).rest), 3)
    total = np.einsum("tnk,n->tk", traction, node_areas(sensor))
    np.testing.assert_allclose(total, truth.force, rtol=0, atol=1e-6)  # N: sums of float32
    assert not traction[:41].any() and traction[50].any()
    assert read_truth(seed_4)[1].tractions == {}


def test_tractions_of_a_finer_tier_are_refused_before_it_begins(scene, tmp_path):
    with pytest.raises(TactileError, match=r"traction_digit: of the full tier.*larger --error"):
        simulate_recording(scene, tmp_path / "x.h5", keep=("traction_digit",), tiers={"digit": "full"})


def test_a_press_that_comes_again_is_solved_once(tmp_path, asked):
    down_and_up = ball_scene((0.0, -8.0, 0.0, 0.0), (0.03, -8.0, 0.0, 0.3), (0.06, -8.0, 0.0, 0.0))
    (tmp_path / "scene.toml").write_text(down_and_up, encoding="utf-8")
    simulate_recording(tmp_path, tmp_path / "gel.h5", keep=("displacement_digit",))
    assert [force for _, force, _ in asked] == pytest.approx([0.1, 0.2, 0.3])
    moved = read_truth(tmp_path / "gel.h5")[1].displacement_digit
    np.testing.assert_array_equal(moved[1], moved[5])


def test_a_scene_that_never_presses_is_said(tmp_path, capsys):
    tap = ball_scene((0.0, -8.0, 0.0, 0.0), (0.005, -8.0, 0.0, 0.3), (0.01, -8.0, 0.0, 0.0))  # between two frames
    (tmp_path / "scene.toml").write_text(tap, encoding="utf-8")
    assert main(["simulate", str(tmp_path), "--keep", "displacement_digit", "--out", str(tmp_path / "x.h5")]) == 0
    assert "no frame presses: raise force_n, or hold it" in capsys.readouterr().err


def test_same_seed_same_bytes_and_another_changes_the_counts_alone(scene, seed_4, tmp_path):
    again, other = tmp_path / "again.h5", tmp_path / "other.h5"
    simulate_recording(scene, again, seed=4)
    simulate_recording(scene, other, seed=5)
    assert seed_4.read_bytes() == again.read_bytes()
    one, two = recordings.read(seed_4), recordings.read(other)
    assert (one.electrodes != two.electrodes).any()
    np.testing.assert_array_equal(one.truth.displacement_biotac, two.truth.displacement_biotac)
    np.testing.assert_array_equal(one.pdc, two.pdc)


def test_pdc_counts_hold_a_hundred_kilopascal():
    np.testing.assert_array_equal(pdc_counts(np.array([-1e3, 0.0, 36.5e3, 149e3, 1e6])), [0, 0, 1000, 4082, 4095])
    pressure = np.linspace(0, 99.9e3, 1000)
    np.testing.assert_allclose(pdc_counts(pressure) * PRESSURE_PER_COUNT, pressure, atol=PRESSURE_PER_COUNT / 2)


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


def test_electrodes_alone_need_no_digit(scene, seed_4, tmp_path, asked):
    simulate_recording(scene, tmp_path / "x.h5", seed=4, keep=("electrodes",))
    assert {sensor for sensor, *_ in asked} == {"biotac"}
    whole, part = recordings.read(seed_4), recordings.read(tmp_path / "x.h5")
    np.testing.assert_array_equal(part.electrodes, whole.electrodes)
    np.testing.assert_array_equal(part.truth.force, whole.truth.force)
    assert part.truth.displacement_biotac is part.truth.displacement_digit is part.truth.contact_center is None
    assert "truth (force)" in info.describe(tmp_path / "x.h5")


def test_the_gel_alone_needs_no_biotac(scene, seed_4, tmp_path, asked):
    simulate_recording(scene, tmp_path / "x.h5", keep=("displacement_digit",))
    assert {sensor for sensor, *_ in asked} == {"digit"}
    time, truth = read_truth(tmp_path / "x.h5")
    whole = recordings.read(seed_4)
    np.testing.assert_array_equal(time, whole.time)
    np.testing.assert_array_equal(truth.displacement_digit, whole.truth.displacement_digit)
    np.testing.assert_array_equal(truth.contact_center, whole.truth.contact_center)
    # Both bear the force asked for; their surfaces lean differently, so the parts across the motion differ.
    sizes = [np.linalg.norm(force, axis=1) for force in (truth.force, whole.truth.force)]
    np.testing.assert_allclose(*sizes, rtol=0.05)
    with pytest.raises(TactileError, match="--keep electrodes"):
        recordings.read(tmp_path / "x.h5")


def test_each_sensor_is_solved_by_its_tier(scene, tmp_path, asked):
    keep = ("displacement_biotac", "displacement_digit")
    simulate_recording(scene, tmp_path / "full.h5", keep=keep, tiers={"digit": "full"})
    assert {(sensor, tier) for sensor, _, tier in asked} == {("biotac", "fast"), ("digit", "full")}
