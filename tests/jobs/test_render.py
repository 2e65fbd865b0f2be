"""`tactile render`: every kind of input, what it leaves behind, and bad input."""

import dataclasses
import json
import os
import shutil
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import ROOT, SHIPPED
from gel_pictures import NO_MITSUBA, Press

from tactile_core.cli.main import main
from tactile_core.jobs.frames_file import FramesFile
from tactile_core.jobs.render import Pictures
from tactile_core.pictures.camera_curve import bent, ends
from tactile_core.pictures.height_map import gel_mapper
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors import digit_surface
from tactile_core.sensors.calibration_file import load_calibration, write_calibration

SCENES = ROOT / "scenes"


@pytest.fixture
def render(tmp_path, capsys):
    """Render into tmp_path/out by the fast preset; returns (status, stdout, stderr)."""

    def run(given, *more, out="out"):
        preset = () if {"--preset", "--error"} & set(more) else ("--preset", "fast")
        status = main(["render", str(given), "--out", str(tmp_path / out), *preset, *map(str, more)])
        return status, *capsys.readouterr()

    return run


@pytest.fixture
def small():
    """The shipped unit, which the command takes by default, with 60 x 80 pixels."""
    return load_calibration().at_size(60, 80)


@pytest.fixture
def heights(tmp_path, small):
    """A file of three height maps of 60 x 80."""
    path = tmp_path / "heights.npz"
    maps = [Press(depth=depth).on(small.camera) for depth in (0.3e-3, 0.6e-3, 0.9e-3)]
    np.savez(path, height_map=np.array(maps))
    return path


def picture(path):
    from PIL import Image

    return np.asarray(Image.open(path))


def test_height_maps_become_pictures(render, heights, tmp_path, small):
    status, out, err = render(heights)
    first = tmp_path / "out" / "images" / "00000.png"
    assert (status, out, err) == (0, f"{tmp_path / 'out'}\n", f"tactile: next: open {first}\n")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["images", "note.json", "timings.json"]
    expected = Renderer(small, "fast")(np.load(heights)["height_map"][1])
    np.testing.assert_array_equal(picture(tmp_path / "out" / "images" / "00001.png"), expected)


def test_frames_of_a_simulated_recording_keep_their_numbers(render, tmp_path):
    assert render(SHIPPED, "--frames", "300:302")[0] == 0
    images = sorted((tmp_path / "out" / "images").iterdir())
    assert [path.name for path in images] == ["00300.png", "00301.png"]
    assert picture(images[0]).shape == (320, 240, 3)


def test_frames_of_a_conversion(render, tmp_path):
    move = np.zeros((2, len(digit_surface().rest), 3), np.float32)
    move[1, :, 1] = 2e-4
    with FramesFile(tmp_path / "frames.h5", 2, ("displacement",), {}) as file:
        file.write(0, {"frame": np.array([7, 9]), "displacement_digit": move})
    assert render(tmp_path / "frames.h5")[0] == 0
    unit, images = load_calibration(), tmp_path / "out" / "images"
    renderer = Renderer(unit, "fast")
    np.testing.assert_array_equal(picture(images / "00007.png"), np.rint(renderer.background))
    np.testing.assert_array_equal(picture(images / "00009.png"), renderer(gel_mapper(unit.camera)(move[1])))


def test_a_scene_is_simulated_first(render, tmp_path, monkeypatch):
    from tactile_core.simulation import scene_recording

    asked = []

    def simulated(scene, out, progress, keep):
        asked.append((Path(scene), keep))
        shutil.copy(SHIPPED, out)

    monkeypatch.setattr(scene_recording, "simulate_recording", simulated)
    assert render(SCENES / "press_roll_slide", "--frames", "300:301")[0] == 0
    assert asked == [(SCENES / "press_roll_slide", ("displacement_digit",))]
    note = json.loads((tmp_path / "out" / "note.json").read_text(encoding="utf-8"))
    assert note["input"]["kind"] == "scene" and note["input"]["file"] == "scene.toml"


def test_another_size(render, tmp_path):
    status, _, err = render(SHIPPED, "--size", "480x480")
    assert status == 2 and "aspect ratio" in err
    assert render(SHIPPED, "--frames", "300:301", "--size", "480x640")[0] == 0
    assert picture(tmp_path / "out" / "images" / "00300.png").shape == (640, 480, 3)


def test_a_white_object_shows_through(render, heights, tmp_path, small):
    assert render(heights, "--object-reflectance", "1")[0] == 0
    drawn = picture(tmp_path / "out" / "images" / "00001.png").astype(int)
    assert (drawn - Renderer(small, "fast")(np.load(heights)["height_map"][1]))[..., 0].max() > 20
    note = json.loads((tmp_path / "out" / "note.json").read_text(encoding="utf-8"))
    assert note["object_reflectance"] == 1


def test_exr_holds_radiance_and_the_picture_follows_from_it(render, heights, tmp_path, small):
    pytest.importorskip("OpenEXR", reason='OpenEXR is missing: pip install "tactile-core[render]"')
    from tactile_core.files.exr_file import read_exr

    assert render(heights, "--exr")[0] == 0
    planes, about = read_exr(tmp_path / "out" / "exr" / "00002.exr")
    rest, _ = read_exr(tmp_path / "out" / "rest.exr")
    camera, _ = read_exr(tmp_path / "out" / "camera.exr")
    assert set(planes) == set(rest) == {"R", "G", "B"}
    assert all(values.dtype == np.float32 for values in planes.values())
    assert (about["calibration"], about["preset"], about["frame"]) == (small.unit, "fast", "2")
    assert "levels" in about["units"]
    bands = dict(zip(("red", "green", "blue"), "RGB", strict=True))
    drawn = [
        camera[f"ambient.{name}"] + sum(camera[f"response.{name}.{led}"] * planes[band] for led, band in bands.items())
        for name in "RGB"
    ]
    untouched = Renderer(small, "fast").background
    levels = np.clip(np.rint(untouched + bent(np.stack(drawn, -1) - untouched, ends(untouched))[0]), 0, 255)
    shown = picture(tmp_path / "out" / "images" / "00002.png")
    assert np.abs(levels - shown).max() <= 1  # the sum in another order may round otherwise
    assert np.mean(levels != shown) < 1e-3
    basis = np.stack([planes[name] for name in "RGB"], -1)
    np.testing.assert_array_equal(basis, Renderer(small, "fast").radiance(np.load(heights)["height_map"][2]))


def test_height_maps_come_as_exr_too(render, tmp_path, small, press):
    pytest.importorskip("OpenEXR", reason='OpenEXR is missing: pip install "tactile-core[render]"')
    from tactile_core.files.exr_file import write_exr

    height = press.on(small.camera)
    for number, channels in enumerate(({"height": height}, {"anything": height}, {"height": height, "Y": 0 * height})):
        write_exr(tmp_path / f"{number}.exr", channels, {})
        assert render(tmp_path / f"{number}.exr", out=f"out{number}")[0] == 0
        shown = picture(tmp_path / f"out{number}" / "images" / "00000.png")
        np.testing.assert_array_equal(shown, Renderer(small, "fast")(height))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device stands for a full disk here")
def test_a_disk_that_is_full_at_an_exr_is_said(render, heights, tmp_path, monkeypatch):
    pytest.importorskip("OpenEXR", reason='OpenEXR is missing: pip install "tactile-core[render]"')
    from tactile_core.files import exr_file

    monkeypatch.setattr(exr_file, "atomic", SimpleNamespace(new_file=lambda path: nullcontext("/dev/full")))
    status, _, said = render(heights, "--exr")
    assert status == 2 and "No space left on device" in said and not (tmp_path / "out").exists()


def test_the_note_says_how_and_equal_input_gives_equal_bytes(render, heights, tmp_path):
    for out in ("one", "two"):
        assert render(heights, out=out)[0] == 0
    for name in ("note.json", "images/00002.png"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    note = json.loads((tmp_path / "one" / "note.json").read_text(encoding="utf-8"))
    assert note["preset"]["name"] == "fast" and note["preset"]["measured"]["error"] > 0
    assert note["input"]["kind"] == "height map" and len(note["calibration"]["sha256"]) == 64


def test_an_input_that_goes_while_it_is_drawn_costs_nothing(render, heights, tmp_path, monkeypatch):
    begin = Pictures.begin

    def begin_and_remove(self, folder):
        heights.unlink()
        begin(self, folder)

    monkeypatch.setattr(Pictures, "begin", begin_and_remove)
    assert render(heights)[0] == 0 and (tmp_path / "out" / "note.json").exists()


def test_mitsuba_draws_where_it_is(render, heights, tmp_path, any_variant):
    assert render(heights, "--preset", "standard", "--frames", "2:")[0] == 0
    note = json.loads((tmp_path / "out" / "note.json").read_text(encoding="utf-8"))
    assert note["versions"]["mitsuba_variant"] == any_variant
    assert len(list((tmp_path / "out" / "images").iterdir())) == 1


def test_an_error_chooses_the_preset(render, heights, tmp_path):
    assert render(heights, "--error", "50levels")[0] == 0
    assert json.loads((tmp_path / "out" / "note.json").read_text(encoding="utf-8"))["preset"]["name"] == "fast"


def test_a_missing_mitsuba_is_named(render, heights, monkeypatch):
    from tactile_core.pictures import renderer

    def absent(wanted):
        raise ModuleNotFoundError("No module named 'mitsuba'", name="mitsuba")

    monkeypatch.setattr(renderer, "choose_variant", absent)
    status, _, err = render(heights, "--preset", "quality")
    assert status == 2
    assert '-e ".[render]"' in err
    assert NO_MITSUBA.endswith('"tactile-core[render]"')


def test_noise_is_the_units_and_the_same_in_every_run(render, heights, tmp_path, small):
    for out, more in (("plain", ()), ("one", ("--noise",)), ("two", ("--noise",))):
        assert render(heights, *more, out=out)[0] == 0
    plain, one, two = (
        picture(tmp_path / out / "images" / "00001.png").astype(float) for out in ("plain", "one", "two")
    )
    np.testing.assert_array_equal(one, two)
    found = (one - plain).std((0, 1))
    expected = np.sqrt(np.square(small.noise) + 1 / 6)  # both pictures are rounded, a variance of 1/12 each
    np.testing.assert_allclose(found, expected, rtol=0.1)  # 4,800 pixels: 1 %; and clipping at 0 and 255
    assert not np.array_equal(one, picture(tmp_path / "one" / "images" / "00002.png"))


def test_an_older_result_is_replaced_only_when_asked(render, heights, tmp_path):
    assert render(heights)[0] == 0
    status, _, err = render(heights)
    assert status == 2 and "--overwrite" in err
    assert render(heights, "--overwrite")[0] == 0
    (tmp_path / "converted").mkdir()  # a result's note tells which verb made it
    (tmp_path / "converted" / "note.json").write_text('{"format": "tactile-result-1"}')
    status, _, err = render(heights, "--overwrite", out="converted")
    assert status == 2 and "no result of this verb" in err and (tmp_path / "converted" / "note.json").exists()


def save(**arrays):
    return lambda path: np.savez(path, **arrays)


@pytest.mark.parametrize(
    ("name", "write", "words"),
    [
        ("absent.npz", lambda path: None, "no such file"),
        ("a.npz", lambda path: path.write_bytes(b"not a zip"), "a.npz"),
        ("a.h5", lambda path: path.write_bytes(b"not HDF5"), "a.h5"),
        ("a.txt", lambda path: path.write_text("hello"), "a.txt"),
        ("a.npz", save(height_map=np.zeros((80, 60)) + np.nan), "not finite"),
        ("a.npz", save(height_map=np.zeros((80, 60)) + 6.0), "metres"),
        ("a.npz", save(height_map=np.zeros((80, 50))), "aspect ratio"),
        ("a.npz", save(height_map=np.zeros(80)), "shape"),
        ("a.npz", save(height_map=np.zeros((0, 80, 60))), "shape"),
        ("a.npz", save(height_map=np.array("text")), "shape"),
        ("a.npz", save(one=np.zeros((80, 60)), two=np.zeros((80, 60))), "height_map"),
        ("a.npz", save(height_map=np.array([[{}]])), "a.npz"),
    ],
)
def test_a_bad_input_ends_in_one_message_and_leaves_nothing(name, write, words, render, tmp_path):
    write(tmp_path / name)
    status, out, err = render(tmp_path / name)
    (line,) = err.splitlines()
    assert (status, out) == (2, "")
    assert line.startswith("tactile: error: ") and words in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--size", "large"], "--size"),
        (["--size", "120x160"], "the height map"),
        (["--frames", "7:"], "none of the 3 frames"),
        (["--error", "0levels"], "--error"),
        (["--error", "0.5"], "--error"),
        (["--error", "1e-9levels"], "or more, which"),
        (["--error", "1levels", "--preset", "fast"], "one of the two"),
        (["--calibration", "absent.toml"], "absent.toml"),
        (["--object-reflectance", "1.5"], "0 to 1"),
    ],
)
def test_bad_options_end_in_one_message(more, words, render, heights, tmp_path):
    status, _, err = render(heights, *more)
    assert status == 2
    assert words in err.splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_a_bound_on_a_scene_s_gel_is_simulate_s(render):
    status, _, err = render(SCENES / "press", "--error", "9um")
    assert status == 2 and "Simulate the scene first" in err


@pytest.mark.parametrize("size", ["24000x32000", "3000x4000"])
def test_a_size_without_bound_is_refused(size, render):
    status, _, err = render(SHIPPED, "--frames", "0:1", "--size", size)
    assert status == 2 and "at most 10 million pixels" in err


def photographed(tmp_path: Path, small) -> Path:
    """A calibration whose picture at rest is a photograph, 7 levels brighter than the lights' own, beside it."""
    from PIL import Image

    shown = (Renderer(small, "fast").background + 7).clip(0, 255)
    Image.fromarray(np.rint(shown).astype(np.uint8)).save(tmp_path / "untouched.png")
    unit = dataclasses.replace(small, photograph=str(tmp_path / "untouched.png"))
    write_calibration(tmp_path / "unit.toml", unit)
    return tmp_path / "unit.toml"


def test_the_size_of_a_photographs_correction_is_said(render, heights, tmp_path, small):
    status, _, err = render(heights, "--calibration", photographed(tmp_path, small))
    assert status == 0 and "untouched.png, 7 levels from the lights' own picture" in err
    background = json.loads((tmp_path / "out" / "note.json").read_text())["background"]
    assert background["photograph"] == "untouched.png"
    assert background["corrects_lights_by"]["mean_levels"] == pytest.approx(7, abs=0.1)
    render(heights, out="plain")
    assert json.loads((tmp_path / "plain" / "note.json").read_text())["background"] == "lights"


def test_llvm_that_is_missing_is_named_with_what_to_do(render, heights, monkeypatch, any_variant):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "/no/such/libLLVM.so")
    status, _, err = render(heights, "--preset", "standard", "--variant", "llvm")
    assert status == 2 and "/no/such/libLLVM.so, which is not there" in err and "tactile doctor" in err
    assert render(heights, "--preset", "standard")[0] == 0  # by the other variant


def test_a_scene_file_takes_no_other_file_s_place(render, heights, tmp_path):
    for name, mine in (("gel.xml", "<xml/>"), ("gel.ply", "plywood"), ("gel.camera.exr", "v/1")):
        (tmp_path / name).write_text(mine)
        status, _, err = render(heights, "--scene-out", tmp_path / "gel.xml")
        assert status == 2 and f"{name}: exists already (a file)" in err and "--overwrite" in err
        status, _, err = render(heights, "--scene-out", tmp_path / "gel.xml", "--overwrite")
        assert status == 2 and f"{name}: a file that is no scene's" in err
        assert not (tmp_path / "out").exists() and (tmp_path / name).read_text() == mine
        (tmp_path / name).unlink()
