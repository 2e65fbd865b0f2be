"""``blender -b --command tactile``."""

import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def run(part, scene):
    """Calls the command as Blender does; the exit status."""
    return lambda *arguments: part("addon.process.command_line").main([str(argument) for argument in arguments])


def test_convert_writes_a_blend_and_pictures_and_render_draws_them(run, slide_csv, tmp_path):
    assert run("convert", slide_csv(), "--out", tmp_path / "out", "--pictures", "--frames", "60:66:3") == 0
    assert run("render", tmp_path / "out" / "touch" / "touch.blend", "--out", tmp_path / "again") == 0
    words = ["render", tmp_path / "out" / "touch" / "touch.blend", "--out"]
    assert run(*words, tmp_path / "some", "--frames", "61:63") == 0
    assert run(*words, tmp_path / "none", "--frames", "70:80") == 1 and not (tmp_path / "none").exists()
    pictures = {"out": (60, 63), "again": range(60, 64), "some": (61, 62)}  # render draws all that the scene plays
    for folder, frames in pictures.items():
        names = sorted(path.name for path in (tmp_path / folder / "touch" / "images").iterdir())
        assert names == [f"{frame:04d}.png" for frame in frames]


def test_render_draws_the_gel_of_the_blend_s_camera(run, imported, tmp_path):
    """As F12 does; it drew the gel that was selected when the file was saved."""
    for frames in ("80:81", "90:91"):
        imported(frames=frames)
        bpy.ops.tactile.translate()
        bpy.ops.tactile.set_up_render()
    scene, objects = bpy.context.scene, bpy.context.view_layer.objects
    seen, objects.active = scene.camera.name, scene.objects["DIGIT gel"]
    assert scene.camera.parent != objects.active
    scene.frame_start = scene.frame_end = 90
    scene.render.use_overwrite = False  # --overwrite says else
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two.blend"))
    stale = tmp_path / "two" / "images" / "0090.png"
    stale.parent.mkdir(parents=True)
    stale.write_text("of a former result")
    assert run("render", tmp_path / "two.blend", "--out", tmp_path, "--overwrite") == 0
    assert bpy.context.scene.camera.name == seen and stale.stat().st_size > 1000


def test_a_batch_goes_on_after_a_failure_and_names_it(run, slide_csv, tmp_path, capfd):
    folder = tmp_path / "day"
    folder.mkdir()
    slide_csv("good", folder=folder)
    (folder / "bad.csv").write_text("a,b\n1,2\n")
    (folder / "notes.txt").write_text("left alone")
    (folder / "evening").mkdir()
    assert run("batch", folder, "--out", tmp_path / "out", "--frames", "60:62") == 1
    assert (tmp_path / "out" / "good" / "good.blend").is_file() and not (tmp_path / "out" / "bad").exists()
    said = capfd.readouterr().err
    assert said.count("bad.csv: no known recording") == 1 and "Error:" not in said
    assert "1 of 2 failed" in said and "notes" not in said and "evening: a folder, passed over" in said


def test_an_older_result_is_kept_unless_told(run, slide_csv, tmp_path, capfd):
    path = slide_csv()
    assert run("convert", path, "--out", tmp_path / "out", "--frames", "60:62") == 0
    assert run("convert", path, "--out", tmp_path / "out", "--frames", "60:62") == 1
    assert "--overwrite" in capfd.readouterr().err
    assert run("convert", path, "--out", tmp_path / "out", "--frames", "60:62", "--overwrite") == 0


def test_a_second_input_of_the_same_name_overwrites_nothing(run, slide_csv, tmp_path, capfd):
    for name in "ab":
        (tmp_path / name).mkdir()
    paths = [slide_csv(folder=tmp_path / name) for name in "ab"]
    assert run("convert", *paths, "--out", tmp_path / "out", "--frames", "60:62", "--overwrite") == 1
    said = capfd.readouterr().err
    assert f"{tmp_path / 'out' / 'touch'}: is the result of {paths[0]}" in said and "1 of 2 failed" in said


def test_nothing_to_do_is_an_error(run, tmp_path):
    assert run("batch", tmp_path, "--out", tmp_path / "out") == 1


def test_a_preset_that_is_none_ends_before_the_work(run, tmp_path, capfd):
    with pytest.raises(SystemExit, match="2"):
        run("convert", "touch.csv", "--out", tmp_path, "--preset", "best")
    assert "'best'" in capfd.readouterr().err and not [*tmp_path.iterdir()]


def test_each_finger_of_a_file_is_converted(run, slide_csv, needs, tmp_path):
    """Only the first was, without a word."""
    needs("scipy")
    import scipy.io

    counts = np.loadtxt(slide_csv(), delimiter=",", skiprows=1)[:, -19:].T
    pdc = np.full((1, 150), 2000.0)
    hand = {"F0Electrodes": counts[::-1], "F0pdc": pdc, "F1Electrodes": counts, "F1pdc": pdc}
    scipy.io.savemat(tmp_path / "hand.mat", hand)
    assert run("convert", tmp_path / "hand.mat", "--out", tmp_path / "out", "--frames", "60:62") == 0
    assert run("convert", f"{tmp_path / 'hand.mat'}#1", "--out", tmp_path / "second", "--frames", "60:62") == 0
    made = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.blend"))
    first, second = (f"hand_finger{k}/hand_finger{k}.blend" for k in (0, 1))
    assert made == [f"out/{first}", f"out/{second}", f"second/{second}"]


def test_options_that_would_do_nothing_are_refused(run, tmp_path, capfd):
    (tmp_path / "touch.blend").touch()
    press, out = ROOT / "scenes" / "press", ("--out", tmp_path / "out")
    for words in (
        ("render", tmp_path / "touch.blend", "--ball", "28"), ("simulate", press, "--frames", "0:4"),
        ("convert", tmp_path / "touch.csv", "--seed", "5"),
    ):  # fmt: skip
        assert run(*words, *out) == 1
        assert f"{words[2]}: given for {words[1]}, to which it does nothing" in capfd.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        run("convert", "touch.csv", *out, "--error", "best")
    assert "--error: 'best'; expected" in capfd.readouterr().err


def test_simulate_a_scene(run, tmp_path):
    pytest.importorskip("scipy")
    folder = tmp_path / "tiny"
    folder.mkdir()
    text = (ROOT / "scenes" / "press" / "scene.toml").read_text()
    at = "x_mm = -8.0, z_mm = 0.0"
    points = f"points = [{{ time_s = 0.0, {at}, force_n = 0.0 }}, {{ time_s = 0.01, {at}, force_n = 0.2 }}]\n"
    (folder / "scene.toml").write_text(text[: text.index("points")] + points)
    assert run("simulate", folder, "--out", tmp_path / "out") == 0
    assert (tmp_path / "out" / "tiny" / "tiny.blend").is_file() and not list(tmp_path.rglob("*.blend1"))
    assert len(list((tmp_path / "out" / "tiny" / "tactile_simulations").glob("*.h5"))) == 1


@pytest.mark.skipif(not bpy.app.binary_path, reason="the wheel has no command line")
def test_a_real_blender_takes_the_command(slide_csv, tmp_path):
    command = [bpy.app.binary_path, "--background", "--addons", "bl_ext.user_default.tactile", "--command", "tactile"]
    done = subprocess.run(
        [*command, "convert", str(slide_csv()), "--out", str(tmp_path / "out"), "--frames", "60:62"],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "out" / "touch" / "touch.blend").is_file()
