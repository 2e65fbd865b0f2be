"""The found contact solved on the DIGIT, in place of the networks' gel, or on a gel that no networks lead to."""

import importlib.util
import json

import h5py
import numpy as np
import pytest
from PIL import Image

from tactile_core import accuracy, recordings, sensors
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Sphere
from tactile_core.jobs import solved_gel
from tactile_core.jobs.convert import ToolOptions
from tactile_core.jobs.solved_gel import describe_miss, gel_traction
from tactile_core.mechanics.node_areas import node_areas
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import solve
from tactile_core.recordings.flags import Flag
from tactile_core.sensors.calibration_file import load_calibration
from tactile_core.translation.networks import WEIGHTS_FOLDER

RECORDING = "scenes/press_roll_slide/press_roll_slide.h5"
needs_scipy = pytest.mark.skipif(importlib.util.find_spec("scipy") is None, reason="needs scipy, of the extra [fem]")


def arrays(gels, force, center):
    return {
        "displacement_digit": np.array(gels, np.float32), "force": np.array(force), "contact_center": np.array(center),
        "flags": np.zeros(len(gels), np.uint16),
    }  # fmt: skip


@pytest.fixture(scope="module")
def pressed():
    """A ball of 5 mm pressed into the middle of the gel under 1 N."""
    pytest.importorskip("scipy", reason="contacts are solved with scipy, of the extra [fem]")
    return solve("digit", Sphere(5e-3), Placement(-8e-3, 1e-3), force=1.0)


def test_a_solved_gel_is_the_gel_that_was_pressed(pressed):
    gel = pressed.displacement[None]
    center = accuracy.dent_center(gel, sensors.digit_surface().rest)
    found = solved_gel.solved(arrays(gel, [pressed.force], center))
    assert accuracy.rms_in_contact(found["displacement_digit"], gel)[0] < 0.05 * accuracy.height(gel).max()
    assert found["flags"][0] == 0


def test_a_known_ball_has_its_own_depth_under_the_force(pressed):
    """The networks' dent is that of a ball of 10 mm under 1 N; a ball of 60 mm touched."""
    true = solve("digit", Sphere(30e-3), Placement(-8e-3, 1e-3), force=1.0).displacement[None]
    center = accuracy.dent_center(pressed.displacement[None], sensors.digit_surface().rest)
    errors = {"expected_error_digit": np.float32([1e-4]), "error_bound_digit": np.float32([4e-4])}
    found = solved_gel.solved(arrays([pressed.displacement], [pressed.force], center) | errors, ball=30e-3)
    dents = [accuracy.lengths(each).max() for each in (found["displacement_digit"], pressed.displacement)]
    np.testing.assert_allclose(found["expected_error_digit"], 1e-4 * dents[0] / dents[1], rtol=1e-6)  # float32
    assert found["error_bound_digit"] == errors["error_bound_digit"]
    assert accuracy.rms_in_contact(found["displacement_digit"], true)[0] < 0.05 * accuracy.height(true).max()
    assert accuracy.height(pressed.displacement[None]).max() > 1.4 * accuracy.height(true).max()


@pytest.mark.parametrize("gel", ["ball", "ball:", "ball:x", "ball:nan", "ball:0.5", "ball:-28", "ball:3000", "box"])
def test_what_is_no_gel_is_refused(gel):
    with pytest.raises(
        TactileError, match=r"--gel: .*; expected translated, solved or ball:MM, a diameter of 1 to 2000"
    ):
        ToolOptions(gel=gel).load_networks()


def test_frames_without_contact_or_solution_keep_their_gel(pressed):
    gel = pressed.displacement
    found = solved_gel.solved(arrays([gel, gel], [[0, 0, 0], [0, 50.0, 0]], [[np.nan, np.nan], [-8e-3, 0.0]]))
    assert np.array_equal(found["displacement_digit"], np.array([gel, gel], np.float32))
    assert found["flags"].tolist() == [0, int(Flag.GEL_NOT_SOLVED)]  # 50 N sink the ball into the gel's back


@needs_scipy
def test_a_conversion_solves_the_frames_it_is_asked_for(request, tmp_path, no_sheet):
    path, found = str(request.config.rootpath / RECORDING), {}
    asked = {"few": ["--frames", "60:240:60"], "fewer": ["--frames", "120:121"]}
    for name, words in (asked | {"large": [*asked["fewer"], "--gel", "ball:100"]}).items():
        out = ["--out", str(tmp_path / name), "--keep", "displacement,traction", "--gel", "solved"]
        assert main(["convert", path, *out, *words]) == 0
        with h5py.File(tmp_path / name / "press_roll_slide" / "frames.h5") as file:
            found[name] = {each: file[each][:] for each in ("displacement_digit", "frame", "flags")}
            total, force = (np.linalg.norm(file[each][:], axis=1) for each in ("traction_force", "force"))
            np.testing.assert_allclose(total, force, rtol=0.01)  # solved under that force along the motion
    one = np.flatnonzero(found["few"]["frame"] == 120)
    gels = found["few"]["displacement_digit"][one], found["fewer"]["displacement_digit"]
    assert accuracy.height(gels[1]).max() > 50e-6
    # The networks' passes of one frame and of several are equal to a relative 1e-5 (``networks``).
    assert np.allclose(*gels, rtol=0, atol=1e-4 * accuracy.height(gels[1]).max())
    assert not (found["few"]["flags"] & Flag.GEL_NOT_SOLVED).any()
    note = json.loads((tmp_path / "large" / "press_roll_slide" / "note.json").read_text(encoding="utf-8"))
    assert note["options"]["gel"] == "ball:100"
    assert accuracy.height(found["large"]["displacement_digit"]).max() < 0.7 * accuracy.height(gels[1]).max()


MINI = "coarse_mini"


@pytest.fixture(autouse=True)
def _mini(coarse_mini):
    pass


def test_a_contact_found_on_one_gel_is_solved_on_another(pressed):
    place = Placement(-8e-3, 1e-3)
    true = solve(MINI, Sphere(5e-3), place, force=1.0).displacement[None]
    gel = pressed.displacement
    center = accuracy.dent_center(gel[None], sensors.digit_surface().rest)[0]
    beside = [-19e-3, 0]  # on the DIGIT's gel, beyond the other's
    force = [pressed.force, [0, 0, 0], pressed.force]
    given = arrays([gel, gel, gel], force, [center, [np.nan, np.nan], beside])
    given |= {"latent_digit": np.ones((3, 4)), "expected_error_digit": np.ones(3), "error_bound_digit": np.ones(3)}
    found = solved_gel.solved(given, MINI, "digit")
    moved = found["displacement_digit"]
    assert moved.shape == (3, len(sensors.sensor_surface(MINI).rest), 3) and not moved[1:].any()
    assert accuracy.rms_in_contact(moved[:1], true)[0] < 0.05 * accuracy.height(true).max()
    assert found["flags"].tolist() == [0, 0, int(Flag.GEL_NOT_SOLVED | Flag.BEYOND_DIGIT)]
    assert np.isnan(found["expected_error_digit"]).all() and "latent_digit" not in found


@pytest.fixture(scope="module")
def short(request, tmp_path_factory):
    """30 frames without contact and 4 of the shipped recording's first press, as an NPZ."""
    pytest.importorskip("scipy", reason="contacts are solved with scipy, of the extra [fem]")
    whole = recordings.read(request.config.rootpath / RECORDING)
    path = tmp_path_factory.mktemp("short") / "short.npz"
    np.savez(path, electrodes=whole.electrodes[[*range(30), *range(74, 82, 2)]])
    return str(path)


def test_every_verb_that_translates_takes_any_gel(short, tmp_path, capsys):
    """Without networks that lead there, and it is said; all three agree."""
    assert main(["convert", short, "--to", MINI, "--keep", "displacement,traction", "--out", str(tmp_path / "a")]) == 0
    said = capsys.readouterr().err
    assert "no networks lead to the Coarse Mini: its gel is solved under the contacts found on a DIGIT's" in said
    assert main(["batch", short, "--to", MINI, "--keep", "displacement,traction", "--out", str(tmp_path / "b")]) == 0
    assert "no networks lead to the Coarse Mini" in capsys.readouterr().err
    file = next((tmp_path / "b" / "shards").glob("*.h5"))
    with h5py.File(tmp_path / "a" / "short" / "frames.h5") as whole, h5py.File(file) as shard:
        for name in (f"displacement_{MINI}", f"traction_{MINI}", "traction_force", "force"):
            np.testing.assert_array_equal(whole[name][:], shard[name][:], err_msg=name)
        total = np.einsum("tnk,n->tk", whole[f"traction_{MINI}"][:], node_areas(MINI))
        sizes = (np.linalg.norm(each, axis=1) for each in (total, whole["force"][:]))
        np.testing.assert_allclose(*sizes, rtol=0.01)  # solved under the force along the motion; across it is friction
        assert accuracy.height(whole[f"displacement_{MINI}"][-4:]).max(axis=1).min() > 100e-6
        assert np.isnan(shard[f"expected_error_{MINI}"][:]).all()
    picture = tmp_path / "now.png"
    words = ["--play", "--speed", "0", "--to", MINI, "--out", str(picture)]
    assert main(["watch", short, *words]) == 0
    camera = load_calibration(None, MINI).camera
    with Image.open(picture) as shown:
        assert shown.size == (camera.width, camera.height)
    assert "no networks lead to the Coarse Mini" in capsys.readouterr().err


def test_weights_that_lead_elsewhere_are_refused_unless_the_gel_is_solved(short, tmp_path, capsys, no_sheet):
    words = ["convert", short, "--to", MINI, "--weights", str(WEIGHTS_FOLDER), "--keep", "", "--frames", "30:31"]
    assert main([*words, "--out", str(tmp_path / "a")]) == 2
    assert "networks that translate to coarse_mini. Train some (docs/extend.md), or" in capsys.readouterr().err
    assert main([*words, "--gel", "solved", "--out", str(tmp_path / "b")]) == 0


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(TactileError, match="--gel solved: scipy is not installed"):
        solved_gel.check_installed()


def test_a_traction_adds_up_to_the_force_s_size_along_the_gel_s_own_shear():
    pressed = solve("digit", Sphere(3.5e-3), Placement(-8e-3, 0.0, 0.3, 0.5), depth=0.6e-3)
    size = np.linalg.norm(pressed.force)
    arrays = {
        "displacement_digit": np.stack([pressed.displacement] * 3).astype(np.float32),
        "contact_center": np.array([[-8e-3, 0], [-8e-3, 0], [np.nan, np.nan]], np.float32),
        "force": np.array([[0, 0, size], [0, 2 * size, 0], [0, size, 0]], np.float32),  # of the finger's own frame
    }
    found = gel_traction(arrays)
    sums = np.einsum("tnk,n->tk", found["traction_digit"], node_areas("digit"))
    np.testing.assert_allclose(sums, found["traction_force"], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(sums, axis=1), [size, 2 * size, 0], rtol=1e-5)
    # 1.7 % in nine of ten true dents of nine indenters
    np.testing.assert_allclose(sums[0], pressed.force, atol=0.03 * size)
    assert not found["traction_digit"][2].any()


@pytest.mark.parametrize(
    ("total", "solved", "words"),
    [
        ([[0, 0, 0], [0, 0, 0]], False, "2 of 2 frames with a force show no patch that is pressed"),
        ([[0, 1, 0], [3, 0, 0]], False, "as large as the networks'"),
        ([[0, 1.1, 0], [3.3, 0, 0]], True, "within 10.0% in half of the frames"),
    ],
)
def test_what_a_traction_misses_is_said(total, solved, words):
    force = np.array([[0, 0, 1.0], [0, 3.0, 0]])
    assert words in describe_miss(np.array(total, float), force, solved)
    assert "no frame is in contact" in describe_miss(np.array(total, float), 0 * force, solved)
