"""File > Import > BioTac Recording."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

RECORDING = Path(__file__).resolve().parents[2] / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
TOLERANCE = 1e-3  # mm: ten times what float32 rounds coordinates of 30 mm to, thousand times below a dent


@pytest.fixture
def wanted(loaded, part):
    def of(frame):
        moved = loaded().translation.displacement_biotac[frame - 40]
        rest = part("tactile_core.sensors").biotac_surface().rest
        return part("addon.objects.axes").to_blender(rest + moved, 1000)

    return of


@pytest.mark.parametrize(
    ("options", "frames"),
    [({}, (40, 77, 90, 139)), ({"motion": "MESH_CACHE", "frames": "40:140:2"}, (40, 78, 90, 138))],
)
def test_the_skin_moves_as_the_recording_says_also_every_second_frame(
    options, frames, imported, nodes_of, wanted, scene
):
    skin = imported(**options)
    for frame in frames:
        scene.frame_set(frame)
        np.testing.assert_allclose(nodes_of(skin), wanted(frame), atol=TOLERANCE)


def test_a_mesh_cache_bears_a_name_as_long_as_files_have(imported, tmp_path):
    path = tmp_path / f"{'指' * 84}.h5"
    path.write_bytes(RECORDING.read_bytes())
    imported(filepath=str(path), frames="70:90", motion="MESH_CACHE")


def test_save_as_elsewhere_takes_caches_along_and_finds_the_recording(imported, scene, tmp_path):
    for name in ("a", "b", "c"):
        (tmp_path / name).mkdir()
    shutil.copyfile(RECORDING, tmp_path / "a" / "touch.h5")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a" / "touch.blend"))
    skin = imported(filepath=str(tmp_path / "a" / "touch.h5"), frames="70:90", motion="MESH_CACHE")

    def named():
        return skin.tactile.recording, skin.modifiers["Tactile"].filepath

    cache = Path(named()[1]).name
    assert named() == ("//touch.h5", f"//tactile_cache/{cache}")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "c" / "copy.blend"), copy=True)
    assert named() == ("//touch.h5", f"//tactile_cache/{cache}")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b" / "touch.blend"))
    (tmp_path / "a" / "tactile_cache").rename(tmp_path / "gone")
    for file in ("b/touch.blend", "c/copy.blend"):
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / file))
        skin = next(thing for thing in bpy.context.scene.objects if thing.tactile.role == "BIOTAC")
        assert named() == ("//../a/touch.h5", f"//tactile_cache/{cache}")
        assert Path(bpy.path.abspath(named()[1])).is_file()
    bpy.ops.tactile.translate()


def test_save_as_by_another_path_to_the_same_folder_keeps_the_cache(imported, scene, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "a", target_is_directory=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a" / "touch.blend"))
    skin = imported(frames="70:72", motion="MESH_CACHE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "link" / "again.blend"))
    assert Path(bpy.path.abspath(skin.modifiers["Tactile"].filepath)).is_file()


def test_save_as_leaves_the_recordings_of_another_blend_alone(imported, scene, part, tmp_path):
    simulated = tmp_path / "a" / "tactile_simulations" / "Ball.h5"
    another = tmp_path / "b" / "tactile_simulations" / "Ball.h5"
    for file, content in ((simulated, RECORDING.read_bytes()), (another, b"another's")):
        file.parent.mkdir(parents=True)
        file.write_bytes(content)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a" / "touch.blend"))
    skin = imported(filepath=str(simulated), frames="70:72")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b" / "touch.blend"))
    assert another.read_bytes() == b"another's"
    assert skin.tactile.recording == "//tactile_simulations/Ball_2.h5"
    assert Path(bpy.path.abspath(skin.tactile.recording)).read_bytes() == RECORDING.read_bytes()


def test_a_long_recording_has_a_mesh_cache_that_goes_with_the_file(
    imported, nodes_of, loaded, part, monkeypatch, tmp_path
):
    monkeypatch.setattr(part("addon.operators.recording_data"), "LONG", 50)

    def right(gel=False):
        for frame in (40, 78, 138):
            bpy.context.scene.frame_set(frame)
            roles = ("BIOTAC", "DIGIT")[: 1 + gel]
            for thing in [each for each in bpy.context.scene.objects if each.tactile.role in roles]:
                field = {"BIOTAC": "displacement_biotac", "DIGIT": "displacement_digit"}[thing.tactile.role]
                rest = part("addon.settings.properties").surface_of(thing).rest
                wanted = rest + getattr(whole, field)[frame - 40]
                wanted = part("addon.objects.axes").to_blender(wanted, 1000)
                np.testing.assert_allclose(nodes_of(thing), wanted, atol=TOLERANCE)

    whole = loaded().translation
    skin = imported()  # never saved: in the extension's own folder
    own = Path(skin.modifiers["Tactile"].filepath)
    assert own.is_file() and own.name.startswith("press_roll_slide_biotac_")
    bpy.ops.tactile.translate()
    right(gel=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"), copy=True)
    right(gel=True)  # the file itself still has none
    (tmp_path / "here").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "here" / "a.blend"))
    assert skin.modifiers["Tactile"].filepath == f"//tactile_cache/{own.name}"
    assert not own.exists()
    right(gel=True)
    (tmp_path / "here").rename(tmp_path / "there")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "there" / "a.blend"))
    right(gel=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "copy.blend"))
    right(gel=True)


def test_a_mesh_cache_of_a_new_file_of_blender_s_is_in_its_units(imported, nodes_of):
    bpy.ops.wm.read_homefile(use_factory_startup=True)  # with cube, light and camera
    skin = imported(frames="70:72", motion="MESH_CACHE")
    assert np.ptp(nodes_of(skin), axis=0).max() == pytest.approx(28, abs=3)  # mm


def test_the_scene_plays_in_the_recording_s_time(imported, scene):
    scene.render.frame_map_new = 50
    imported()
    assert scene.render.frame_map_new == scene.render.frame_map_old
    assert (scene.frame_start, scene.frame_end) == (40, 139)
    assert scene.render.fps / scene.render.fps_base == pytest.approx(100, rel=1e-6)
    assert scene.unit_settings.scale_length == pytest.approx(1e-3)


def test_the_scene_s_own_unit_is_kept_when_asked(imported, scene, nodes_of):
    skin = imported(frames="70:72", millimetres=False)
    assert scene.unit_settings.scale_length == 1.0
    assert np.ptp(nodes_of(skin)[:, 0]) == pytest.approx(0.02796, abs=2e-4)  # m, the skin's length (docs/sources.md)


def test_electrodes_sit_under_the_skin_and_show_their_signal(imported, loaded, part, scene):
    imported()
    change = loaded().signals.change
    colours = part("addon.objects.electrode_markers").colours_of(change)
    places = part("addon.objects.axes").to_blender(part("tactile_core.sensors").electrodes(), 1000)
    for frame in (50, 80):
        scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for k in range(19):
            marker = scene.objects[f"E{k + 1}"]
            np.testing.assert_allclose(marker.evaluated_get(depsgraph).color[:3], colours[frame - 40, k], atol=1e-5)
            np.testing.assert_allclose(marker.matrix_world.translation, places[k], atol=TOLERANCE)


def test_custom_properties_follow_the_recording(imported, loaded, scene):
    skin = imported()
    found = loaded()
    scene.frame_set(80)
    shown = skin.evaluated_get(bpy.context.evaluated_depsgraph_get())
    force = found.translation.force[40]
    np.testing.assert_allclose(list(shown["force"]), [force[0], force[2], -force[1]], rtol=1e-5)
    np.testing.assert_allclose(list(shown["electrodes"]), found.signals.change[40], rtol=1e-5, atol=1e-4)
    assert shown["confidence"] == pytest.approx(found.translation.confidence[40], rel=1e-5)
    assert shown["pdc"] == pytest.approx(found.recording.pdc[80], rel=1e-6)


def test_a_property_can_drive_something(imported, loaded, scene):
    skin = imported()
    follower = bpy.data.objects.new("follower", None)
    scene.collection.objects.link(follower)
    driver = follower.driver_add("location", 2).driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = skin, '["force"][2]'
    scene.frame_set(80)
    place = follower.evaluated_get(bpy.context.evaluated_depsgraph_get()).location
    assert place.z == pytest.approx(-loaded().translation.force[40, 1], rel=1e-5)


def test_the_core_lies_inside_the_skin(imported, nodes_of, scene):
    skin = imported(frames="70:72")
    core = scene.objects["BioTac core"]
    low, high = nodes_of(skin).min(axis=0), nodes_of(skin).max(axis=0)
    inside = nodes_of(core)
    assert np.isfinite(inside).all() and (inside > low).all() and (inside < high).all()


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("not_a_recording.csv", b"a,b,c\n1,2,3\n", "no known recording"),
        ("damaged.h5", b"\x89HDF\r\n\x1a\nrubbish", "damaged"),
        ("absent.csv", None, "no such file"),
    ],
)
def test_what_is_no_recording_is_reported_and_changes_nothing(scene, tmp_path, name, content, expected):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RuntimeError, match=expected):
        bpy.ops.tactile.import_recording(filepath=str(path))
    assert not scene.objects and not bpy.data.meshes and scene.unit_settings.scale_length == 1.0


def test_frames_that_are_not_there_are_reported(imported, scene):
    with pytest.raises(RuntimeError, match="none of the 360 frames"):
        imported(frames="5000:6000")
    assert not scene.objects


def test_one_frame_is_enough(imported, nodes_of, wanted):
    skin = imported(frames="80:81")
    np.testing.assert_allclose(nodes_of(skin), wanted(80), atol=TOLERANCE)


def test_frames_before_0_which_no_range_of_blender_s_holds_are_named(imported, scene, capfd):
    imported(frames="40:42", first_frame=-41)
    assert "Frames -1 to -1 are not rendered" in capfd.readouterr().out
    imported(frames="40:42", first_frame=-40)
    assert "not rendered" not in capfd.readouterr().out


def test_a_recording_on_another_drive_keeps_its_whole_path(imported, tmp_path, monkeypatch):
    """On Windows no relative path leads there: the import ended in a traceback, half done."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "here.blend"))

    def on_another_drive(*_):
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr("os.path.relpath", on_another_drive)
    assert imported(frames="70:72").tactile.recording == str(RECORDING)


def test_undo_takes_it_back(imported, scene):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    imported(frames="70:72")
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert not bpy.context.scene.objects


def test_a_recording_read_in_another_process_is_the_same(part):
    reader, read = part("addon.process.recording_reader"), part("tactile_core.recordings").read
    if not reader._hdf5_works():
        pytest.skip("HDF5 does not work in this Blender's own process")
    found, wanted = reader._read_elsewhere(str(RECORDING)), read(RECORDING)
    for name in ("name", "layout", "start_time", "warnings", "simulated", "about", "rate"):
        assert getattr(found, name) == getattr(wanted, name)
    for name in ("time", "electrodes", "rows", "flags", "pdc"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
    np.testing.assert_array_equal(found.truth.displacement_digit, wanted.truth.displacement_digit)


def test_what_another_process_cannot_read_is_told_as_here(part, tmp_path):
    bad = tmp_path / "bad.h5"
    bad.write_bytes(b"\x89HDF\r\n\x1a\nrubbish")
    with pytest.raises(part("tactile_core.errors").TactileError, match="damaged"):
        part("addon.process.recording_reader")._read_elsewhere(str(bad))


def test_a_dropped_file_opens_a_popup(extension, part):
    """Blender has no windows here: the operator's own function is called."""
    operator = part("addon.operators.import_recording").TACTILE_OT_import_recording
    context = SimpleNamespace(window_manager=SimpleNamespace(invoke_props_dialog=lambda _, **words: words["title"]))
    for path, files, title in (("/day/touch.h5", [], "touch.h5"), ("", ["a.csv", "b.csv"], "2 recordings")):
        dropped = SimpleNamespace(filepath=path, files=[SimpleNamespace(name=name) for name in files])
        assert operator.invoke(dropped, context, None) == title
