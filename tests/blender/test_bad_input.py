"""Files and scenes that are not as the extension makes them: each works, or says what to do."""

import shutil

import bpy
import pytest


@pytest.fixture
def gel(pressed_gel):
    return pressed_gel


def test_renamed_parts_are_known_by_their_roles(gel, part):
    for thing in (*gel.children_recursive, gel):
        thing.name = f"my {thing.name}"
    assert part("addon.objects.digit_body").leds_of(gel).keys() == {"red", "green", "blue"}
    assert bpy.ops.tactile.set_style(style="DISPLACEMENT") == {"FINISHED"}
    assert bpy.ops.tactile.set_up_render() == {"FINISHED"}
    assert bpy.ops.tactile.translate() == {"FINISHED"}
    assert sum(thing.tactile.role == "DIGIT" for thing in bpy.context.scene.objects) == 1


def test_a_renamed_gel_keeps_its_contact_patch(gel, imported, nodes_of):
    def patch(gel):
        held = gel.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes["contact_patch"]
        return [each.value for each in held.data]

    bpy.context.scene.frame_set(85)
    before, gel.name = patch(gel), "mine"
    copy = gel.copy()
    bpy.context.scene.collection.objects.link(copy)
    imported(frames="0:20")
    bpy.ops.tactile.translate()
    bpy.ops.tactile.translate()  # replaces its own
    bpy.context.scene.frame_set(85)
    assert any(before) and patch(gel) == before == patch(copy)
    assert sum("contact patch" in image.name for image in bpy.data.images) == 2


def test_a_deleted_gel_comes_back_with_its_body(gel):
    skin = next(thing for thing in bpy.context.scene.objects if thing.tactile.role == "BIOTAC")
    for thing in (*gel.children_recursive, gel):
        bpy.data.objects.remove(thing)
    bpy.context.view_layer.objects.active = skin
    with pytest.raises(RuntimeError, match="no DIGIT"):
        bpy.ops.tactile.set_up_render()
    assert bpy.ops.tactile.translate() == {"FINISHED"}
    assert sum(thing.tactile.role == "LED" for thing in bpy.context.scene.objects) == 3


def test_a_deleted_skin_is_asked_for(gel):
    bpy.data.objects.remove(next(t for t in bpy.context.scene.objects if t.tactile.role == "BIOTAC"))
    assert not bpy.ops.tactile.translate.poll()
    assert bpy.ops.tactile.set_style(style="CONTACT_PATCH") == {"FINISHED"}


def test_two_gels_are_drawn_each_by_its_own_parts(gel, draw, part):
    copy = gel.copy()
    copy.location.y += 80
    bpy.context.scene.collection.objects.link(copy)
    before = [draw(gel) for gel in (gel, copy)]
    part("addon.objects.digit_body").leds_of(gel)["red"].data.energy = 0.0
    after = [draw(gel) for gel in (gel, copy)]
    assert (before[0] - after[0]).max() > 50  # levels: the red LED is off
    assert (before[1] == after[1]).all()  # a copy without LEDs has the calibration's


def test_the_camera_s_gel_is_drawn_with_an_empty_between(gel, part):
    bpy.ops.tactile.set_up_render()
    copy, empty = gel.copy(), bpy.data.objects.new("empty", None)
    for thing in (copy, empty):
        bpy.context.scene.collection.objects.link(thing)
    empty.parent, bpy.context.scene.camera.parent = copy, empty
    assert part("addon.settings.properties").gel_of(bpy.context.scene) == copy


def test_a_material_of_the_user_s_is_kept_beside_the_coating(gel):
    """Set Up Render removed it, and the next save lost it."""
    own = bpy.data.materials.new("velvet")
    gel.data.materials.clear()
    gel.data.materials.append(own)
    bpy.ops.tactile.set_up_render()
    first, second = (slot.material for slot in gel.material_slots)
    assert first.name.startswith("DIGIT coating") and second == own
    assert not any(face.material_index for face in gel.data.polygons)


@pytest.mark.parametrize("scale", [(1, 1, -1), (-1, 1, 1), (0, 1, 1)])
def test_a_mirrored_indenter_is_refused_in_words(scene, scale):
    pytest.importorskip("msgspec")
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    bpy.ops.tactile.add_indenter(shape="sphere")
    thing = bpy.context.object
    thing.scale = scale
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="scale"):
        bpy.ops.tactile.snap_to_gel()


@pytest.mark.parametrize("scale", [(1, 1, -1), (2, 2, 2), (3, 1, 1)])
def test_a_scaled_or_mirrored_gel_draws_what_it_drew(gel, draw, scale):
    before = draw(gel)
    gel.scale = scale
    bpy.context.scene.frame_set(80)
    assert (draw(gel) == before).all()


def test_a_gel_scaled_to_nothing_is_named(gel, draw, part):
    pytest.importorskip("msgspec")
    bpy.ops.tactile.add_indenter(shape="sphere")
    ball = bpy.context.object
    gel.scale = (0, 1, 1)
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="DIGIT gel: a scale of 0"):
        bpy.ops.tactile.snap_to_gel()
    with pytest.raises(part("tactile_core.errors").TactileError, match="DIGIT gel: a scale of 0"):
        draw(gel)
    depth_of = part("addon.operators.snap_to_gel").depth_of
    assert depth_of(bpy.context, ball) is None  # the panel goes on


def test_the_panel_goes_on_where_the_indenter_meets_no_gel(gel, part):
    pytest.importorskip("msgspec")
    bpy.ops.tactile.add_indenter(shape="sphere")
    ball = bpy.context.object
    depth_of = part("addon.operators.snap_to_gel").depth_of
    assert depth_of(bpy.context, ball) is not None
    ball.location.x += 200
    bpy.context.view_layer.update()
    assert depth_of(bpy.context, ball) is None


def test_what_lay_beside_a_moved_file_is_named(imported, tmp_path, part):
    (tmp_path / "here").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "here" / "touch.blend"))
    imported(frames="70:90", motion="MESH_CACHE")
    bpy.ops.tactile.translate()
    bpy.ops.tactile.save_as_calibration(filepath=str(tmp_path / "here" / "unit.toml"))
    bpy.context.scene.tactile_render.calibration = "//unit.toml"
    bpy.ops.wm.save_mainfile()
    (tmp_path / "there").mkdir()
    shutil.copy(tmp_path / "here" / "touch.blend", tmp_path / "there" / "touch.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "there" / "touch.blend"))
    with pytest.raises(RuntimeError, match=r"unit\.toml.*Choose another as Calibration"):
        bpy.ops.tactile.set_up_render()
    bpy.context.scene.tactile_render.calibration = ""
    bpy.ops.tactile.set_up_render()
    with pytest.raises(RuntimeError, match=r"DIGIT gel: its mesh cache .*digit.*\.pc2 is gone.*with the \.blend"):
        bpy.ops.render.render()


def test_a_linked_sensor_is_left_alone_in_words(gel, tmp_path):
    """A library's objects are read-only."""
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(path), link=True) as (held, taken):
        taken.objects = list(held.objects)
    for thing in taken.objects:
        bpy.context.scene.collection.objects.link(thing)
    for changes in ("set_style", "force_arrow", "set_up_render", "reset_to_calibration"):
        with pytest.raises(RuntimeError, match="library"):
            getattr(bpy.ops.tactile, changes)()
    # which reads alone
    assert bpy.ops.tactile.save_as_calibration(filepath=str(tmp_path / "unit.toml")) == {"FINISHED"}
    skin = next(thing for thing in taken.objects if thing.tactile.role == "BIOTAC").override_create()
    bpy.context.scene.collection.objects.link(skin)
    bpy.context.view_layer.objects.active = skin
    with pytest.raises(RuntimeError, match=r"BioTac skin: linked from library\.blend.* Append it"):
        bpy.ops.tactile.translate()  # whose keys are the mesh's, not an override's


def test_a_file_of_the_former_version_gets_what_it_lacks(gel):
    """Format 1 had no colour on its meshes and no friction of a press."""
    gel.data.attributes.active_color_name = ""
    gel.tactile.format, gel.add_rest_position_attribute = 1, False
    assert bpy.ops.tactile.set_style(style="DISPLACEMENT") == {"FINISHED"}
    shown = gel.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert shown.color_attributes.active_color.name == "Tactile colour"


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("a.csv: odd; expected counts. Give the unit's own (--sensor), or frames (--tare)",
         "a.csv: odd; expected counts. Give the unit's own (Unit), or frames (Tare)"),
        ("Name it in a map: tactile info FILE --columns map.toml writes one to fill in",
         "Name it in a map: Columns writes the file that it names"),
        ("a.csv: missing. Check the path; to try with a recording that ships: tactile scenes copy press_roll_slide",
         "a.csv: missing. Check the path"),
        ("--frames: 'x'", "Frames: 'x'"), ("two (--frames-apart)", "two (Each Frame Alone)"),
        ("LLVM missing. See `tactile doctor`", "LLVM missing. Check LLVM in the add-on's preferences"),
    ],
)  # fmt: skip
def test_errors_have_blender_s_words(part, said, shown):
    assert part("addon.settings.reports").in_blender(said) == shown


def test_no_folder_of_a_job_is_named(part):
    with part("addon.process.jobs").JobFolder() as folder:
        said = f"{folder / 'scene.toml'}, recording: missing"
        assert part("addon.settings.reports").in_blender(said) == "scene.toml, recording: missing"


def test_buttons_without_what_they_need_are_greyed(scene, part):
    assert not bpy.ops.tactile.set_up_render.poll() and not bpy.ops.tactile.simulate.poll()
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    assert bpy.ops.tactile.set_up_render.poll() and not bpy.ops.tactile.simulate.poll()
