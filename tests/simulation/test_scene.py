"""Scenes that ship load; anything else is refused with file and field."""

import pathlib

import msgspec
import pytest

from tactile_core.errors import TactileError
from tactile_core.simulation.scene import Scene, load_scene, to_toml, write_scene

SCENES = pathlib.Path(__file__).parents[2] / "scenes"
GOOD = (SCENES / "press_sphere" / "scene.toml").read_text(encoding="utf-8")


def write(folder, text):
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("radius_mm = 3.5", "radius = 3.5", "radius"),
        ("radius_mm = 3.5", "radius_mm = -3.5", "radius_mm"),
        ("radius_mm = 3.5", 'radius_mm = "3.5"', "radius_mm"),
        ("radius_mm = 3.5", "radius_mm = inf", "infinite"),
        ("force_ratio = 1.5", "force_ratio = 1.0", "force_ratio"),
        ("tilt_max_deg = 20.0", "tilt_max_deg = 80.0", "tilt_max_deg"),
        ('kind = "sphere"', 'kind = "teapot"', "teapot"),
        ('"sphere_14mm"', '"sphere_7mm"', "different names"),
        ("tactile-scene-1", "tactile-scene-9", "tactile-scene-1"),
        ("[pairs]", "[pears]", "pears"),
        ("[pairs]", "[pairs", "end of a table"),
        ("[pairs]", "[pairs]\ndepth_steps = 5\ndepth_min_mm = 2.0", "depth_min_mm"),
        ("[pairs]", "[pairs]\ndepth_steps = 5\nslide_share = 0.3", "slide_share"),
        ("time_s = 0.5,", "time_s = 9.5,", "growing times"),
        ("force_n = 1.0", "force_n = 1e300", r"the number 1e\+300"),
    ],
)
def test_bad_scene_is_refused(tmp_path, old, new, said):
    good = GOOD if old in GOOD else (SCENES / "press_roll_slide" / "scene.toml").read_text(encoding="utf-8")
    assert old in good
    path = write(tmp_path, good.replace(old, new))
    with pytest.raises(TactileError, match=said) as caught:
        load_scene(path)
    assert str(path) in str(caught.value)


def test_missing_scene(tmp_path):
    with pytest.raises(TactileError, match="cannot be read"):
        load_scene(tmp_path)


FOLDERS = sorted(path.parent for path in SCENES.glob("*/scene.toml"))


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_shipped_scenes_load_and_come_back_equal(folder, tmp_path):
    scene, text = load_scene(folder)
    assert scene.name == folder.name and text == (folder / "scene.toml").read_text(encoding="utf-8")
    assert [type(spec.build()) for spec in scene.indenters]
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
