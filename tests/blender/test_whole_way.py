"""An author's whole way: a ball keyed in an empty file, simulated, exported, paired, trained small, translated."""

from __future__ import annotations

import importlib.util
import runpy
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]
CONTACTS, EFFORT = 200, 0.01  # enough for each stage to run, not for a translation to be good


@pytest.fixture
def tactile(part):
    """``tactile("pairs", ...)``: a verb of the command line on this Python."""

    def run(*arguments):
        command = [sys.executable, "-P", "-m", "tactile_core", *map(str, arguments)]
        environment = part("addon.process.jobs")._environment()
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr

    return run


@pytest.fixture
def authored(scene, tmp_path):
    """The folder of press.blend, its exported scene and its simulated recording."""
    for name in ("h5py", "msgspec", "scipy"):
        pytest.importorskip(name)
    for sensor in ("BIOTAC", "DIGIT"):
        bpy.ops.tactile.add_sensor(sensor=sensor)
    bpy.ops.tactile.add_indenter(shape="sphere", radius=4.0)
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 4, 100
    for frame, depth in ((1, -0.2), (4, 0.4)):
        bpy.ops.tactile.snap_to_gel(depth=depth)
        bpy.context.object.keyframe_insert("location", frame=frame)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "press.blend"))
    bpy.ops.tactile.simulate()
    bpy.ops.tactile.export_scene(filepath=str(tmp_path / "press" / "scene.toml"))
    return tmp_path


def test_an_exported_scene_is_paired(authored, tactile, part):
    tactile("pairs", authored / "press" / "scene.toml", "--count", 2, "--out", authored / "pairs.h5")
    pairs = part("tactile_core.simulation.pairs_file").read_pairs(authored / "pairs.h5")
    assert len(pairs.force) == 2 and (pairs.depth_digit > 0).all()


@pytest.mark.skipif(importlib.util.find_spec("torch") is None, reason="torch is missing")
def test_what_was_paired_is_trained_translated_and_drawn(authored, tactile):
    pytest.importorskip("matplotlib")
    pairs, weights = authored / "pairs.h5", authored / "trained" / "weights"
    tactile("pairs", authored / "press" / "scene.toml", "--count", CONTACTS, "--out", pairs)
    tactile("train", pairs, "--out", weights.parent, "--effort", EFFORT)
    recording = authored / "tactile_simulations" / "sphere.h5"
    tactile("convert", recording, "--out", authored / "out", "--weights", weights)
    assert len(list((authored / "out" / "sphere" / "images").glob("*.png"))) > 0


def test_the_example_is_written(extension, tmp_path):
    pytest.importorskip("h5py")
    path = tmp_path / "example.blend"
    runpy.run_path(str(ROOT / "scenes" / "press_roll_slide" / "make_blend.py"))["write"](path)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert {"BIOTAC", "DIGIT"} <= {thing.tactile.role for thing in bpy.context.scene.objects}
    assert bpy.context.scene.camera is not None
