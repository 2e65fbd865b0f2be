"""Import and show: what a new file begins with is hidden, a second recording stands apart, images stay."""

import runpy
from pathlib import Path

import bpy
import numpy as np
import pytest


@pytest.fixture
def new_file(scene):
    """A file as File > New > General makes it."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.context.scene


def test_untouched_objects_of_a_new_file_are_hidden(new_file, imported):
    imported(frames="70:90")
    scene = bpy.context.scene
    assert all(scene.objects[name].hide_viewport and scene.objects[name].hide_render for name in ("Cube", "Light"))
    assert scene.unit_settings.scale_length == pytest.approx(1e-3)


def test_a_moved_cube_stays_and_with_it_the_scene_s_units_and_rate(new_file, imported, capfd):
    new_file.objects["Cube"].location.x = 3
    imported(frames="70:90")
    scene = bpy.context.scene
    assert not scene.objects["Cube"].hide_viewport
    assert scene.unit_settings.scale_length == 1 and scene.render.fps == 24
    assert "range are kept: it plays 0.24 times as fast as recorded" in capfd.readouterr().out
    # What was kept here is no choice for the next import, which a window would begin with it.
    choices = bpy.ops.tactile.import_recording.get_rna_type().properties
    assert choices["set_timeline"].is_skip_save and choices["millimetres"].is_skip_save


def test_the_firmest_frame_is_shown(imported):
    skin = imported()
    scene = bpy.context.scene
    shown, forces = scene.frame_current, []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        forces.append(np.linalg.norm(skin["force"]))
    assert shown == scene.frame_start + int(np.argmax(forces))


def test_a_second_recording_stands_apart_and_leaves_the_range(imported):
    first = imported(frames="70:90")
    scene = bpy.context.scene
    before = scene.frame_start, scene.frame_end
    second = imported(frames="100:140")
    assert abs(second.location.y - first.location.y) > 50
    assert (scene.frame_start, scene.frame_end) == before


def test_images_survive_save_and_reopen(imported, tmp_path):
    imported(frames="70:90")
    bpy.ops.tactile.translate()
    image = bpy.data.images["DIGIT picture"]
    before = np.array(image.pixels[:])
    for _ in range(2):  # packed once, and packed again
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert np.abs(np.array(bpy.data.images["DIGIT picture"].pixels[:]) - before).max() < 0.01


def test_there_is_nothing_to_translate_without_a_recording(scene):
    bpy.ops.tactile.add_sensor(sensor="BIOTAC")
    assert not bpy.ops.tactile.translate.poll()


def test_the_panel_says_an_indenter_s_shape_in_words(scene, part):
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    assert part("addon.ui.panels")._shape(bpy.context.object.tactile.spec) == "sphere, radius 3.5 mm"


def test_a_workspace_is_offered_in_a_window_alone(extension):
    assert not bpy.ops.tactile.open_workspace.poll()  # what it opens is photographed by scripts/fetch_blender.py


def test_the_example_s_script_writes_it(scene, needs, tmp_path):
    needs("h5py")
    script = Path(__file__).parents[2] / "scenes" / "press_roll_slide" / "make_blend.py"
    runpy.run_path(str(script))["write"](tmp_path / "example.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "example.blend"))
    assert {"BIOTAC", "DIGIT"} <= {thing.tactile.role for thing in bpy.context.scene.objects}
    assert bpy.context.scene.camera is not None
