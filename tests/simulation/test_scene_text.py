"""Scenes written as TOML come back equal."""

from __future__ import annotations

import pathlib

import msgspec
import pytest

from tactile_core.errors import TactileError
from tactile_core.simulation.scene import Scene, load_scene
from tactile_core.simulation.scene_text import to_toml, write_scene

SCENES = pathlib.Path(__file__).parents[2] / "scenes"
FOLDERS = sorted(path.parent for path in SCENES.glob("*/scene.toml"))


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_shipped_scenes_come_back_equal(folder, tmp_path):
    scene = load_scene(folder)[0]
    meshes, specs = {}, []
    for spec in scene.indenters:
        if hasattr(spec, "file"):
            meshes[pathlib.Path(spec.file).name] = pathlib.Path(spec.file).read_bytes()
            spec = msgspec.structs.replace(spec, file=pathlib.Path(spec.file).name)
        specs.append(spec)
    scene = msgspec.structs.replace(scene, indenters=specs)
    write_scene(tmp_path, scene, meshes)
    assert msgspec.toml.decode((tmp_path / "scene.toml").read_bytes(), type=Scene) == scene
    load_scene(tmp_path)


@pytest.mark.parametrize("text", ['a "quoted" \\ word', "two\nlines\t", "ünïcode 指", "\x00\x1f\x7f"])
def test_text_of_any_kind_survives(text):
    scene = load_scene(SCENES / "press_sphere")[0]
    scene = msgspec.structs.replace(scene, description=text)
    assert msgspec.toml.decode(to_toml(scene), type=Scene) == scene


def test_numbers_survive_to_the_last_bit():
    scene = load_scene(SCENES / "press_roll_slide")[0]
    points = [msgspec.structs.replace(point, x_mm=point.x_mm + 0.1 + 1e-15) for point in scene.recording.points]
    scene = msgspec.structs.replace(scene, recording=msgspec.structs.replace(scene.recording, points=points))
    assert msgspec.toml.decode(to_toml(scene), type=Scene) == scene


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(TactileError, match="cannot be written"):
        write_scene(tmp_path / "file", load_scene(SCENES / "press_sphere")[0], {})
