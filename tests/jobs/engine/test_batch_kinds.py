"""Simulation and rendering as jobs: the same bytes as by one process, whoever makes the parts."""

import json

import h5py
import numpy as np
import pytest
from ball_scene import ball_scene

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.files import checksummed
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import local


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "scene.toml").write_text(ball_scene((0.0, -8.0, 0.0, 0.0), (0.02, -8.0, 0.0, 0.5)))
    return tmp_path / "scene.toml"


def tree(folder):
    files = [file for file in sorted(folder.rglob("*")) if file.is_file() and file.name != "timings.json"]
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


def run(*words):
    assert main([str(word) for word in words]) == 0


def by_parts(tmp_path, monkeypatch, *words):
    """Plan, two runners of an array, one with a worker, and the command again: the result's folder."""
    out = tmp_path / "parts"
    run(*words, "--out", out, "--plan")
    for part in ("1/2", "0/2"):
        run("batch", "--out", f"{out}.parts", "--array", part)
        monkeypatch.setattr(local, "Local", lambda folder, workers: local.InProcess(folder))
    run("batch", "--out", f"{out}.parts", "--verify")
    run(*words, "--out", out, "--workers", "1")
    assert not out.with_name("parts.parts").exists()
    return out


def test_a_grid_of_recordings(scene, tmp_path, monkeypatch):
    # The gel alone: each of the processes that simulate would set up the skin's films anew, half of its time.
    words = ["simulate", scene, "--grid", "force_n=0.2,0.4", "--seed", "5", "--keep", "displacement_digit"]
    run(*words, "--out", tmp_path / "one")
    said = json.loads((tmp_path / "one" / "grid.json").read_text())["recordings"]
    assert [one["values"] for one in said] == [{"force_n": 0.2}, {"force_n": 0.4}]
    with h5py.File(tmp_path / "one" / said[1]["file"]) as file:
        # of the axial force, tilted skin
        assert np.linalg.norm(file["truth/force"][-1]) == pytest.approx(0.4, rel=0.05)
        assert file.attrs["seed"] == 6 and "0.4" in file.attrs["scene"]
    assert tree(by_parts(tmp_path, monkeypatch, *words)) == tree(tmp_path / "one")


def test_a_grid_is_refused_before_any_work(scene, tmp_path, capsys):
    for words, said in (
        (["--grid", "recording.tilt=1"], "no such field"),
        (["--grid", "force_n=1", "--error", "5um"], "one of the two"),
        (["--workers", "2"], "without --grid"),
    ):
        assert main(["simulate", str(scene), "--out", str(tmp_path / "out"), *words]) == 2
        assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [scene]


def test_what_cannot_be_simulated_is_told_by_name(scene, tmp_path, capsys):
    words = ["simulate", str(scene), "--grid", "force_n=0.2,200", "--out", str(tmp_path / "out")]
    assert main(words) == 2
    assert "a force that the" in capsys.readouterr().err and not (tmp_path / "out").exists()
    assert len(list((tmp_path / "out.parts" / "shards").glob("*.h5"))) == 1  # the other one waits for a better grid


@pytest.fixture
def heights(tmp_path):
    """Three height maps of 60 x 80."""
    random = np.random.default_rng(1)
    maps = 1.5e-3 + 1e-4 * random.random((3, 80, 60)).cumsum(axis=1) / 80
    np.savez(tmp_path / "heights.npz", height_map=maps)
    return tmp_path / "heights.npz"


def test_pictures(heights, tmp_path, monkeypatch):
    words = ["render", heights, "--preset", "fast", "--frames", "1:3", "--noise"]
    run(*words, "--out", tmp_path / "one")
    assert tree(by_parts(tmp_path, monkeypatch, *words)) == tree(tmp_path / "one")
    assert sorted(tree(tmp_path / "one")) == ["images/00001.png", "images/00002.png", "note.json"]


def test_other_options_do_not_go_on_with_a_job(heights, tmp_path, capsys):
    words = ["render", str(heights), "--out", str(tmp_path / "out"), "--plan", "--preset", "fast"]
    run(*words)
    assert main([*words, "--noise"]) == 2
    assert "holds parts of another" in capsys.readouterr().err


def test_an_input_that_changed_is_refused(heights, tmp_path, capsys):
    words = ["render", str(heights), "--out", str(tmp_path / "out"), "--preset", "fast"]
    run(*words, "--plan")
    heights.write_bytes(heights.read_bytes() + b"x")
    assert main(["batch", "--out", str(tmp_path / "out.parts")]) == 2
    assert "another content" in capsys.readouterr().err


def test_presets_and_photographs_belong_to_the_job(command, recordings, tmp_path):
    pytest.importorskip("mitsuba", reason="mitsuba is absent: pip install tactile-core[render]")
    from PIL import Image

    from tactile_core.sensors.calibration_file import SHIPPED

    out, unit, photograph = tmp_path / "job", tmp_path / "unit.toml", tmp_path / "rest.png"
    Image.new("RGB", (240, 320)).save(photograph)
    unit.write_text(SHIPPED.read_text().replace('photograph = ""', 'photograph = "rest.png"'))
    words = [recordings[1], "--out", out, "--keep", "image", "--calibration", unit, "--preset", "standard", "--plan"]
    assert command(*words).returncode == 0
    recipe = jobs.read(out).recipe
    assert recipe.preset == "standard" and recipe.variant in ("llvm_ad_rgb", "scalar_rgb")
    assert "holds another job" in command(*words[:-2], "quality", "--plan").stderr
    Image.new("RGB", (240, 320), "red").save(photograph)
    assert "holds another job" in command(*words).stderr
    assert "as in the job" in command("--out", out).stderr
    photograph.unlink()
    assert "rest.png: cannot be read" in command(*words).stderr


def test_a_preset_without_pictures_is_told(command, recordings, tmp_path):
    done = command(recordings[1], "--out", tmp_path / "job", "--preset", "quality", "--plan")
    assert done.returncode == 2 and "Keep the pictures" in done.stderr


def test_packs_are_sealed_and_leave_no_folder(tmp_path):
    (tmp_path / "in" / "deep").mkdir(parents=True)
    (tmp_path / "in" / "deep" / "a").write_bytes(b"abc")
    (tmp_path / "in" / "b").write_bytes(b"")
    checksummed.write_files(tmp_path / "pack.h5", tmp_path / "in")
    checksummed.write_files(tmp_path / "again.h5", tmp_path / "in")
    assert (tmp_path / "pack.h5").read_bytes() == (tmp_path / "again.h5").read_bytes()
    assert checksummed.verified_checksum(tmp_path / "pack.h5")
    checksummed.unpack(tmp_path / "pack.h5", tmp_path / "out")
    assert tree(tmp_path / "out") == {"deep/a": b"abc", "b": b""}
    checksummed.write(tmp_path / "bad.h5", {"..": np.zeros(1, np.uint8)})
    with pytest.raises(TactileError, match="inside the folder"):
        checksummed.unpack(tmp_path / "bad.h5", tmp_path / "out")
