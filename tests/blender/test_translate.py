"""The button "Translate to DIGIT"."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

SCENES = Path(__file__).resolve().parents[2] / "scenes"
RECORDING = SCENES / "press_roll_slide" / "press_roll_slide.h5"
TOLERANCE = 1e-3  # mm: ten times what float32 rounds coordinates of 30 mm to


@pytest.fixture
def gel(translated):
    return translated("40:140")


@pytest.fixture
def translation(loaded):
    return loaded().translation


def test_the_gel_moves_as_translated(gel, nodes_of, part, translation):
    rest = part("tactile_core.sensors").digit_surface().rest
    for frame in (40, 80, 139):
        bpy.context.scene.frame_set(frame)
        wanted = part("addon.objects.axes").to_blender(rest + translation.displacement_digit[frame - 40], 1000)
        np.testing.assert_allclose(nodes_of(gel), wanted, atol=TOLERANCE)


def test_the_displacement_can_be_read_back(gel, part, translation):
    bpy.context.scene.frame_set(80)
    found = part("addon.objects.digit_objects").displacement_of(gel, bpy.context.evaluated_depsgraph_get())
    np.testing.assert_allclose(found, translation.displacement_digit[40], atol=1e-3 * TOLERANCE)


def test_the_gel_says_how_far_it_may_be_off(gel, translation):
    bpy.context.scene.frame_set(80)
    shown = gel.evaluated_get(bpy.context.evaluated_depsgraph_get())
    expected = 1e6 * translation.expected_error_digit[40]
    assert shown["expected_error_um"] == pytest.approx(expected, rel=1e-5)


def test_the_panel_s_words_on_trust_are_the_contact_sheet_s(gel, part, translation):
    bpy.context.scene.frame_set(80)
    skin, found = bpy.context.scene.objects["BioTac skin"], translation
    in_words = part("tactile_core.translation.trust_words").in_words
    dent = part("tactile_core.accuracy").lengths(found.displacement_digit[40]).max()
    words = in_words(found.confidence[40], found.flags[40], found.expected_error_digit[40], dent, found.force[40])
    assert part("addon.ui.panels").trust_of(skin, gel) == (words, True)
    assert words.startswith("guess: shape unsure, expected error")


def test_the_panel_s_trust_is_never_another_recording_s(gel, imported, part):
    """A second skin is not translated yet: the scene's only gel is the first's."""
    panels, scene = part("addon.ui.panels"), bpy.context.scene
    other = imported(frames="90:110", first_frame=-20)
    scene.frame_set(80)
    assert part("addon.settings.properties").gel_of(scene, other) == gel
    assert panels.trust_of(other, gel) == panels.trust_of(other, None) != panels.trust_of(gel, gel)
    bpy.data.objects.remove(scene.objects["BioTac skin"])
    said, font = [], SimpleNamespace(label=lambda text, icon: said.append(text))
    layout = SimpleNamespace(column=lambda align: font)
    system, region = SimpleNamespace(ui_scale=1.0), SimpleNamespace(width=9999)
    preferences = SimpleNamespace(system=system)
    for active in (other, gel):
        said.clear()
        context = SimpleNamespace(scene=scene, object=active, preferences=preferences, region=region)
        panels._numbers(layout, context, other)
        assert panels.trust_of(active, active)[0] in said


def test_the_panel_says_that_a_silent_frame_has_no_contact(gel, part, translation):
    silent = int(np.flatnonzero(~translation.force.any(axis=1))[0])
    bpy.context.scene.frame_set(40 + silent)
    words, _ = part("addon.ui.panels").trust_of(bpy.context.scene.objects["BioTac skin"], gel)
    assert "no contact" in words and "expected error" not in words


def test_what_a_new_animation_does_not_say_is_not_kept_from_the_old(gel, part):
    """A simulation over a translation: its trust was shown on."""
    assert "expected_error_um" in gel and part("addon.ui.panels").trust_of(gel, gel)[0]
    rest = part("addon.objects.mesh_cache").in_memory(np.zeros((3, len(gel.data.vertices), 3)), "digit")
    told = {"force": np.zeros((3, 3))}
    part("addon.operators.set_style").animate(gel, rest, np.arange(70.0, 73.0), "SHAPE_KEYS", told)
    assert {*gel.keys()} & {*part("addon.objects.curves").PROPERTIES} == {"force", "dent_um"}
    assert not part("addon.ui.panels").trust_of(gel, gel)[0]
    paths = {curve.data_path for curve in part("addon.objects.curves").fcurves_of(gel)}
    assert paths == {'["force"]', '["dent_um"]'}


def test_flags_are_kept_frame_by_frame(scene, part):
    thing = bpy.data.objects.new("gel", None)
    scene.collection.objects.link(thing)
    values = {"confidence": np.ones(2), "expected_error_um": np.full(2, 370.0), "flags": np.array([0, 4], np.uint16)}
    values["force"] = np.full((2, 3), 0.1)
    part("addon.objects.curves").write_properties(thing, values, np.array([10.0, 20.0]))
    said = {}
    for frame in (10, 19, 20):
        scene.frame_set(frame)
        said[frame] = part("addon.ui.panels").trust_of(thing, None)
    assert said[19] == said[10] == ("as in training, expected error 0.37 mm", False)
    assert said[20] == ("guess: rectified recording, expected error 0.37 mm", True)


def test_the_contact_patch_is_an_attribute_of_every_frame(gel, part, translation):
    surface = part("tactile_core.sensors").digit_surface()
    patch = part("tactile_core.translation.gel_place").contact_patch(translation.displacement_digit, surface)
    assert patch[40].any() and not patch[40].all()
    for frame in (40, 80, 100, 139):
        bpy.context.scene.frame_set(frame)
        shown = gel.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes["contact_patch"]
        values = np.empty(len(surface.rest), np.float32)
        shown.data.foreach_get("value", values)
        np.testing.assert_array_equal(values > 0.5, patch[frame - 40])


def test_the_picture_and_height_map_are_those_of_the_library(gel, part, translation):
    bpy.context.scene.frame_set(80)
    part("addon.operators.pictures").update(gel, bpy.context.evaluated_depsgraph_get())
    heights = part("tactile_core.pictures.height_map").height_map(translation.displacement_digit[40])
    shown = bpy.data.images["DIGIT height map"]
    values = np.empty(320 * 240 * 4, np.float32)
    shown.pixels.foreach_get(values)
    # 1 um: coordinates of 30 mm are held in float32, which rounds them to 2 nm; dents steepen that sideways.
    np.testing.assert_allclose(values.reshape(320, 240, 4)[::-1, :, 0], 1e3 * heights, atol=1e-3)
    picture = part("tactile_core.pictures.renderer").Renderer(preset="fast")(heights)
    bpy.data.images["DIGIT picture"].pixels.foreach_get(values)
    drawn = np.rint(255 * values.reshape(320, 240, 4)[::-1, :, :3])
    assert np.abs(drawn - picture.astype(float)).max() <= 1  # a level: the same rounding of coordinates
    assert np.ptp(picture.astype(float)) > 50


def test_low_confidence_is_marked_on_the_timeline(scene, part):
    """A second recording's marks took the place of the first one's."""
    confidence, mark = np.array([1, 0.2, 0.3, 1, 1, 0.1]), part("addon.operators.view").mark_low_confidence
    assert mark(scene, "skin", confidence, np.arange(10, 16)) == 2
    assert mark(scene, "skin.001", confidence[:2], np.arange(2)) == 1
    assert [(m.frame, m.name) for m in scene.timeline_markers] == [
        (11, "skin: low confidence to 12"), (15, "skin: low confidence to 15"), (1, "skin.001: low confidence to 1"),
    ]  # fmt: skip
    mark(scene, "skin", np.ones(6), np.arange(6))
    assert [m.frame for m in scene.timeline_markers] == [1]


def test_a_gel_in_a_collection_of_the_user_s_is_translated_again(imported, gel):
    """A second gel took its place, while the first still played the former translation."""
    scene, own = bpy.context.scene, bpy.data.collections.new("gels")
    skin = scene.objects["BioTac skin"]
    scene.collection.children.link(own)
    skin.users_collection[0].objects.unlink(gel)
    own.objects.link(gel)
    bpy.context.view_layer.objects.active, skin.tactile.tare = skin, "0:20"
    bpy.ops.tactile.translate()
    assert [*gel["force"]] == [*skin["force"]]
    bpy.context.view_layer.objects.active = gel
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match=r"in Edit Mode.* Press Tab"):
        bpy.ops.tactile.translate()
    bpy.ops.object.mode_set(mode="OBJECT")
    imported()  # the same recording once more has a gel of its own
    bpy.ops.tactile.translate()
    assert sum(thing.tactile.role == "DIGIT" for thing in scene.objects) == 2


def test_sensors_of_an_excluded_collection_are_translated(gel, capfd):
    bpy.context.view_layer.layer_collection.children["press_roll_slide"].exclude = True
    assert bpy.ops.tactile.translate() == {"FINISHED"}
    assert "DIGIT gel: hidden in view layer" in capfd.readouterr().out


@pytest.mark.parametrize("name", ["DIGIT gel", "BioTac skin"])
def test_a_sensor_in_edit_mode_is_refused_and_keeps_its_keys(gel, name):
    """Its keys could not be removed: new ones stood beside them, and another tare ended in a traceback."""
    keys = len(gel.data.shape_keys.key_blocks)
    bpy.context.view_layer.objects.active = bpy.context.scene.objects[name]
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match=r"in Edit Mode.* Press Tab"):
        bpy.ops.tactile.translate()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.tactile.translate() == {"FINISHED"} and len(gel.data.shape_keys.key_blocks) == keys


@pytest.mark.parametrize(("holder", "name"), [("gel", "show_only_shape_key"), ("keys", "use_relative")])
def test_a_gel_that_its_keys_do_not_move_is_refused(gel, part, holder, name):
    """Its picture was that of one shape key, or of rest, on every frame; where NLA strips play the keys, too."""
    moves = gel.data.shape_keys.animation_data
    moves.nla_tracks.new().strips.new("pushed down", 70, moves.action)
    moves.action = None
    setattr(gel if holder == "gel" else gel.data.shape_keys, name, True)
    with pytest.raises(part("tactile_core.errors").TactileError, match=r"DIGIT gel: .*: it does not move"):
        part("addon.operators.pictures").draw(gel, bpy.context.evaluated_depsgraph_get(), "fast")


def test_a_new_translation_plays_alone(imported):
    """A mesh cache or contact patch whose modifier was renamed went on over it, or beside shape keys."""
    skin = imported(frames="70:72", motion="MESH_CACHE")
    for motion, caches in (("MESH_CACHE", 1), ("MESH_CACHE", 1), ("SHAPE_KEYS", 0)):
        skin.tactile.motion, skin.tactile.tare = motion, "60:80" if skin.tactile.tare == "auto" else "auto"
        bpy.ops.tactile.translate()
        for thing in (skin, bpy.context.scene.objects["DIGIT gel"]):
            kinds = [each.type for each in thing.modifiers]
            assert kinds.count("MESH_CACHE") == caches and kinds.count("NODES") == 1  # contact patch, or counts
            for modifier in thing.modifiers:
                modifier.name = "of the user's"


def test_keys_that_were_shifted_come_back_with_the_gel_s(gel, part):
    """The gel went back to the recording's frames alone: skin and gel played apart."""
    skin, curves = bpy.context.scene.objects["BioTac skin"], part("addon.objects.curves")
    for owner, path in ((skin, '["force"]'), (skin.data.shape_keys, "eval_time")):
        for point in curves.fcurves_of(owner).find(path).keyframe_points:
            point.co.x += 50
        bpy.ops.tactile.translate()
        assert curves.points_of(owner, path)[0, 0] == 40


@pytest.mark.parametrize("how", ["convert", "apply"])
def test_a_dent_that_was_made_part_of_the_mesh_goes_with_a_new_translation(gel, part, how):
    """It was taken for every frame's dent, or for the rest that a style measures from."""

    def moved(frame):
        bpy.context.scene.frame_set(frame)
        return part("addon.objects.digit_objects").displacement_of(gel, bpy.context.evaluated_depsgraph_get())

    bpy.ops.tactile.set_style(style="DISPLACEMENT", exaggeration=3.0)
    before = [moved(frame) for frame in (70, 80)]
    bpy.ops.object.select_all(action="DESELECT")
    gel.select_set(True)
    bpy.context.view_layer.objects.active = gel
    if how == "convert":
        bpy.ops.object.convert(target="MESH")
    else:
        bpy.ops.object.shape_key_remove(all=True, apply_mix=True)
    bpy.ops.tactile.translate()
    np.testing.assert_allclose([moved(frame) for frame in (70, 80)], before, atol=1e-7)


def test_a_sensor_that_lost_a_vertex_is_refused(gel):
    """All others were moved by their neighbours' displacements, or a traceback ended it."""
    bpy.context.view_layer.objects.active = gel
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    gel.data.vertices[5].select = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="VERT")
    bpy.ops.object.mode_set(mode="OBJECT")
    with pytest.raises(RuntimeError, match=r"DIGIT gel: a mesh of 2866 vertices; expected the sensor's 2867"):
        bpy.ops.tactile.translate()


def test_a_recording_moved_after_import_is_reported(imported, tmp_path):
    moved = tmp_path / "here.h5"
    shutil.copy(RECORDING, moved)
    imported(filepath=str(moved), frames="70:72")
    moved.rename(tmp_path / "there.h5")
    before = len(bpy.data.objects)
    with pytest.raises(RuntimeError, match=r"here\.h5: there is no such file"):
        bpy.ops.tactile.translate()
    assert len(bpy.data.objects) == before


def test_a_file_of_a_newer_version_is_refused(imported):
    imported(frames="70:72").tactile.format = 99
    with pytest.raises(RuntimeError, match="Update the add-on"):
        bpy.ops.tactile.translate()


def test_a_gel_of_other_vertices_has_no_picture(gel, part):
    gel.modifiers.new("more", "SUBSURF")
    with pytest.raises(RuntimeError, match="Remove modifiers"):
        bpy.ops.tactile.live_picture()


def test_the_live_picture_follows_the_frame_until_it_is_off(gel, part):
    def pixels(frame):
        bpy.context.scene.frame_set(frame)
        values = np.empty(320 * 240 * 4, np.float32)
        bpy.data.images["DIGIT picture"].pixels.foreach_get(values)
        return values

    bpy.ops.tactile.live_picture()
    resting, pressed = pixels(40), pixels(80)
    assert np.abs(pressed - resting).max() > 0.1
    bpy.ops.tactile.live_picture()
    np.testing.assert_array_equal(pixels(40), pressed)  # without a window nobody looks


def test_the_file_plays_without_the_add_on(gel, nodes_of, works_elsewhere, tmp_path):
    bpy.context.scene.frame_set(80)
    wanted, path = nodes_of(gel), tmp_path / "a.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    np.save(tmp_path / "wanted.npy", wanted)
    works_elsewhere(f"""
import bpy, numpy as np
bpy.ops.wm.open_mainfile(filepath={str(path)!r})
bpy.context.scene.frame_set(80)
mesh = bpy.data.objects["DIGIT gel"].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
nodes = np.empty(len(mesh.vertices) * 3, np.float32)
mesh.vertices.foreach_get("co", nodes)
np.testing.assert_array_equal(nodes.reshape(-1, 3), np.load({str(tmp_path / "wanted.npy")!r}))
patch = np.empty(len(mesh.vertices), np.float32)
mesh.attributes["contact_patch"].data.foreach_get("value", patch)
assert patch.any() and not hasattr(bpy.types.Object, "tactile")
print("works")
""")


def test_a_unit_s_file_is_told_and_moves_the_skin_too(imported, part, tmp_path, needs):
    needs("msgspec")
    gains = part("tactile_core.recordings.electrode_gains")
    unit = gains.ElectrodeGains("made for this test", [2.0] * 19, [0.0] * 19, film=1.3)
    gains.write(tmp_path / "unit.toml", gains.units_file({"unit": unit}))
    skin = imported(frames="70:90")
    assert "fluid film: 1.00 as thick" in skin.tactile.known and "different contacts" in skin.tactile.known
    force, markers = skin.tactile.largest, len(skin.children)
    skin.tactile.unit = str(tmp_path / "unit.toml")
    bpy.ops.tactile.translate()
    told = skin.tactile.known.splitlines()
    assert told[0] == "unit: made for this test" and told[1].startswith("fluid film: 1.30 as thick")
    assert skin.tactile.largest < 0.9 * force and len(skin.children) == markers
    bpy.context.scene.frame_set(80)
    lines = part("addon.ui.panels").numbers_of(skin)
    found = part("addon.operators.recording_data")
    explained = next(iter(found._KEPT.values())).translation.explained[10]
    assert f"{100 * explained:.0f} % of the signals explained" in lines[0]
    bpy.ops.tactile.translate()  # again: nothing else was chosen
    assert len(skin.children) == markers


@pytest.fixture
def two_balls(tmp_path, part):
    """A recording of two balls pressed at once, a press of .4 s between parts without contact."""
    rest = part("tactile_core.sensors").REST_COUNTS
    with np.load(SCENES / "training" / "double_contacts.npz") as double:
        change = double["signal"][1]
    share = np.concatenate([np.zeros(60), np.linspace(0, 1, 10), np.ones(20), np.linspace(1, 0, 10), np.zeros(30)])
    np.savez(tmp_path / "two.npz", electrodes=np.rint(rest + share[:, None] * change), time=np.arange(130) / 100)
    return tmp_path / "two.npz"


def test_a_second_contact_is_looked_for_and_said_where_asked(two_balls, part):
    bpy.ops.tactile.import_recording(filepath=str(two_balls), two=True)
    bpy.ops.tactile.translate()
    scene, words = bpy.context.scene, part("addon.ui.panels").numbers_of
    skin = scene.objects["BioTac skin"]
    moved = {}
    for two in (True, False):
        skin.tactile.two = two
        bpy.ops.tactile.translate()
        scene.frame_set(80)
        moved[two] = part("addon.objects.digit_objects").displacement_of(
            scene.objects["DIGIT gel"], bpy.context.evaluated_depsgraph_get()
        )
        assert any(line.startswith("Second contact: ") for line in words(skin)) == two == ("second_force" in skin)
        if two:
            assert skin["second_force"][2] < 0  # into the pad
            scene.frame_set(10)
            assert not any(skin["second_force"])
    assert np.abs(moved[True] - moved[False]).max() > 0.1e-3


@pytest.mark.parametrize(("ball", "to"), [(0, "GELSIGHT_MINI"), (28, "DIGIT")])
def test_two_contacts_on_a_gel_that_is_solved_are_refused(two_balls, ball, to):
    bpy.ops.tactile.import_recording(filepath=str(two_balls), two=True, ball=ball)
    with pytest.raises(RuntimeError, match="Two Contacts"):
        bpy.ops.tactile.translate(to=to)


def test_a_known_ball_is_solved_for(imported, part, needs):
    needs("scipy")
    skin = imported(frames="80:81")
    scene, dents, told = bpy.context.scene, [], []
    for ball in (0, 14):
        skin.tactile.ball = ball
        bpy.ops.tactile.translate()
        scene.frame_set(80)
        gel = scene.objects["DIGIT gel"]
        moved = part("addon.objects.digit_objects").displacement_of(gel, bpy.context.evaluated_depsgraph_get())
        dents.append(np.linalg.norm(moved, axis=1).max())
        told.append(gel["expected_error_um"])
    assert 0.3 * dents[0] < dents[1] < 0.95 * dents[0]  # wider than the body that the signals alone tell of
    assert told[1] / told[0] == pytest.approx(dents[1] / dents[0], rel=0.01)
    skin.tactile.ball = 0.5
    with pytest.raises(RuntimeError, match=r"Known Ball: 0\.5; expected a diameter of 1 to 2000 mm\. A plate is 2000"):
        bpy.ops.tactile.translate()
