"""``tactile mesh``: what it writes, and what it says of options that do not belong together."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.cli.main import main
from tactile_core.geometry.indenters import Cylinder, Sphere

pytest.importorskip("scipy", reason="extra [fem] is not installed")
from tactile_core.mechanics import solve as solve_module

SCENE = """\
format = "tactile-scene-1"
name = "two"
description = "Two balls."
[[indenters]]
kind = "sphere"
name = "small"
radius_mm = 3.5
[[indenters]]
kind = "sphere"
name = "large"
radius_mm = 7.0
"""


@pytest.fixture
def mesh(tmp_path, monkeypatch, capsys):
    """Run ``tactile mesh`` in a folder of its own; returns (status, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)

    def run(*arguments):
        status = main(["mesh", *map(str, arguments)])
        return status, *capsys.readouterr()

    return run


@pytest.fixture
def solved(monkeypatch):
    """In place of the solver: a dent everywhere, and what was asked for."""
    asked = []

    def solve(sensor, indenter, place, *, depth, force, tier):
        asked.append((sensor, indenter, place, depth, force, tier))
        rest = (sensors.biotac_surface() if sensor == "biotac" else sensors.digit_surface()).rest
        return SimpleNamespace(
            converged=True, displacement=np.full_like(rest, 1e-4), contact_patch=rest[:, 0] < 0, volume=None
        )

    monkeypatch.setattr(solve_module, "solve", solve)
    return asked


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
def test_the_resting_surface_is_written(sensor, mesh, tmp_path):
    import trimesh

    told = "tactile: next: open rest.ply in MeshLab or Blender; lengths are in metres\n"
    assert mesh(sensor, "--out", "rest.ply") == (0, "rest.ply\n", told)
    lattice = sensors.biotac_surface() if sensor == "biotac" else sensors.digit_surface()
    read = trimesh.load(tmp_path / "rest.ply", process=False)
    np.testing.assert_array_equal(read.faces, lattice.faces)
    np.testing.assert_allclose(read.vertices, lattice.rest, atol=2e-9)  # float32 of centimetres


def test_the_resting_volume_is_written(mesh, tmp_path):
    assert mesh("digit", "--out", "rest.vtu")[0] == 0
    assert b'type="UnstructuredGrid"' in (tmp_path / "rest.vtu").read_bytes()[:200]


def test_a_press_asks_the_solver_and_is_written(mesh, solved, tmp_path):
    import trimesh

    given = ("--press", "sphere", "--diameter", 7, "--depth-mm", 0.6, "--x-mm", -9, "--z-mm", 1, "--tier", "full")
    assert mesh("digit", *given, "--out", "a.ply")[:2] == (0, "a.ply\n")
    sensor, indenter, place, depth, force, tier = solved[0]
    assert (sensor, indenter, force, tier) == ("digit", Sphere(3.5e-3), None, "full")
    assert (depth, place.x, place.z, place.tilt) == pytest.approx((0.6e-3, -9e-3, 1e-3, 0))
    read = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_allclose(read.vertices - sensors.digit_surface().rest, 1e-4, atol=2e-9)
    columns = read.metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_array_equal(columns["contact"].ravel(), sensors.digit_surface().rest[:, 0] < 0)
    np.testing.assert_allclose(columns["displacement_y"], 1e-4, rtol=1e-6)


def test_a_press_with_a_force_takes_any_indenter_of_a_scene(mesh, solved):
    assert mesh("biotac", "--press", "scene.toml", "--force-n", 0.5, "--out", "a.stl")[0] == 0
    assert mesh("biotac", "--press", ".", "--indenter", "large", "--force-n", 0.5, "--out", "b.stl")[0] == 0
    assert mesh("biotac", "--press", "cylinder", "--diameter", 4, "--force-n", 1, "--out", "c.vtu")[0] == 0
    assert [asked[1] for asked in solved] == [Sphere(3.5e-3), Sphere(7e-3), Cylinder(2e-3, 0.5e-3)]
    assert {asked[3:] for asked in solved} == {(None, 0.5, "fast"), (None, 1.0, "fast")}


def test_a_contact_that_did_not_converge_is_told(mesh, monkeypatch):
    rest = sensors.digit_surface().rest
    missed = SimpleNamespace(
        converged=False, displacement=np.zeros_like(rest), contact_patch=np.zeros(len(rest), bool), volume=None
    )
    monkeypatch.setattr(solve_module, "solve", lambda *arguments, **more: missed)
    status, _, err = mesh("digit", "--press", "sphere", "--diameter", 7, "--depth-mm", 0.1, "--out", "a.ply")
    assert status == 0 and "did not converge" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--out", "a.obj"], "'.obj'; expected .ply or .stl or .vtu"),
        (["--out", ""], "--out: an empty name"),
        (["--out", "m.ply", "--frames", ""], "--frames: an empty value"),
        (["--out", "m.ply", "--press", ""], "--press: an empty value"),
        (["--out", "scene.toml/a.ply"], "cannot be written"),
        (["--out", "a.ply", "--frames", "f.h5"], "one of them alone"),
        (["--out", "a.ply", "--frame", "3"], "one of them alone"),
        (["--out", "a.ply", "--frames", "f.h5", "--frame", "3"], "no such file"),
        (["--out", "a.ply", "--frames", "scene.toml", "--frame", "3"], "no HDF5 file"),
        (["--out", "a.ply", "--frames", "f.h5", "--frame", "3", "--press", "sphere"], "one of the two"),
        (["--out", "a.ply", "--depth-mm", "1"], "--depth-mm: given without --press"),
        (["--out", "a.ply", "--tier", "full"], "--tier: given without --press"),
        (["--out", "a.ply", "--z-mm", "2"], "--z-mm: given without --press"),
        (["--out", "a.ply", "--press", "sphere", "--diameter", "7"], "how far or how hard"),
        (["--out", "a.ply", "--press", "sphere", "--depth-mm", "1"], "no --diameter"),
        (["--out", "a.ply", "--press", "sphere", "--diameter", "nan", "--depth-mm", "1"], "sphere, radius"),
        (["--out", "a.ply", "--press", "sphere", "--diameter", "7", "--depth-mm", "nan"], "depth"),
        (["--out", "a.ply", "--press", "sphere", "--diameter", "7", "--depth-mm", "-1"], "depth"),
        (["--out", "a.ply", "--press", "ball", "--depth-mm", "1"], "scene file that exists"),
        (["--out", "a.ply", "--press", ".", "--depth-mm", "1", "--diameter", "7"], "given with a scene"),
        (["--out", "a.ply", "--press", ".", "--depth-mm", "1", "--indenter", "none"], "one of small, large"),
    ],
)
def test_options_that_do_not_belong_together_end_in_one_message(arguments, said, mesh, tmp_path):
    status, out, err = mesh("digit", *arguments)
    assert (status, out) == (2, "")
    (line,) = err.splitlines()
    assert line.startswith("tactile: error: ") and said in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.toml"]


def test_an_older_file_is_kept(mesh, tmp_path):
    (tmp_path / "a.ply").write_text("mine")
    status, _, err = mesh("digit", "--out", "a.ply")
    assert status == 2 and "exists already" in err
    assert (tmp_path / "a.ply").read_text() == "mine"


@pytest.mark.parametrize("tilt", ["180", "-46", "nan", "inf"])
def test_a_tilt_that_presses_from_elsewhere_is_refused(tilt, mesh):
    words = ("--press", "sphere", "--diameter", "7", "--depth-mm", "0.3", "--out", "m.ply")
    status, _, err = mesh("digit", *words, f"--tilt-deg={tilt}")
    assert status == 2 and "--tilt-deg" in err and "-45 to 45" in err


def test_a_press_by_a_mesh_is_led_to_a_scene(mesh, tmp_path):
    (tmp_path / "star.stl").write_bytes(b"\xff" * 90)
    status, _, err = mesh("digit", "--press", "star.stl", "--depth-mm", "0.3", "--out", "m.ply")
    assert status == 2 and "star.stl: a mesh file; expected sphere, cylinder, or a scene" in err and "user_mesh" in err
