"""An author's whole way: a ball keyed in an empty file, simulated, exported, paired, trained small, translated."""

from __future__ import annotations

import importlib.util
import re
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
    """``tactile("pairs", ...)``: a verb of the command line on this Python, or with ``-c`` a program; its output."""

    def run(*arguments):
        start = [] if arguments[0] == "-c" else ["-m", "tactile_core"]
        command = [sys.executable, "-P", *start, *map(str, arguments)]
        environment = part("addon.process.jobs")._environment()
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture
def authored(scene, needs, tmp_path):
    """The folder of press.blend, its exported scene and its simulated recording."""
    needs("h5py", "msgspec", "scipy")
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


def test_an_exported_scene_is_paired(authored, tactile):
    scene = authored / "press" / "scene.toml"
    head, pairs = scene.read_text(encoding="utf-8").split("[pairs]")
    for name, value in (("depth_max_percent", 15.0), ("force_ratio", 4.0)):  # few steps a press
        pairs = re.sub(rf"(?m)^{name} = .*", f"{name} = {value}", pairs)
    scene.write_text(f"{head}[pairs]{pairs}", encoding="utf-8")
    tactile("pairs", scene, "--count", 2, "--out", authored / "pairs.h5")
    # In a process of its own: some Blenders hold an HDF5 that h5py does not work with.
    read = "import sys; from tactile_core.simulation.pairs_file import read_pairs; pairs = read_pairs(sys.argv[1])"
    told = tactile("-c", f"{read}; print(len(pairs.force), (pairs.depth_digit > 0).all())", authored / "pairs.h5")
    assert told.split() == ["2", "True"]


@pytest.mark.skipif(importlib.util.find_spec("torch") is None, reason="torch is missing")
def test_what_was_paired_is_trained_translated_and_drawn(authored, tactile):
    pytest.importorskip("matplotlib")
    pairs, weights = authored / "pairs.h5", authored / "trained" / "weights"
    tactile("pairs", authored / "press" / "scene.toml", "--count", CONTACTS, "--out", pairs)
    tactile("train", pairs, "--out", weights.parent, "--effort", EFFORT)
    recording = authored / "tactile_simulations" / "sphere.h5"
    tactile("convert", recording, "--out", authored / "out", "--weights", weights)
    assert len(list((authored / "out" / "sphere" / "images").glob("*.png"))) > 0


def test_the_example_is_written(needs, tmp_path):
    needs("h5py")
    path = tmp_path / "example.blend"
    runpy.run_path(str(ROOT / "scenes" / "press_roll_slide" / "make_blend.py"))["write"](path)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert {"BIOTAC", "DIGIT"} <= {thing.tactile.role for thing in bpy.context.scene.objects}
    assert bpy.context.scene.camera is not None
