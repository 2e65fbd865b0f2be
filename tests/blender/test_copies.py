"""A gel that is copied, appended or instanced draws its own picture, or says what is missing."""

from pathlib import Path

import bpy
import numpy as np
import pytest

RECORDING = Path(__file__).resolve().parents[2] / "scenes" / "press_roll_slide" / "press_roll_slide.h5"


@pytest.fixture
def gel(pressed_gel):
    """A translated gel, moved in the scene, its red LED dimmed, on a pressed frame."""
    bpy.ops.tactile.set_up_render()
    pressed_gel.location = (30, 20, 5)
    bpy.data.objects["LED red"].data.energy *= 0.5
    return pressed_gel


def duplicate(gel, *parts, linked=False):
    bpy.ops.object.select_all(action="DESELECT")
    for thing in (gel, *parts):
        thing.hide_select = False
        thing.select_set(True)
    bpy.context.view_layer.objects.active = gel
    bpy.ops.object.duplicate(linked=linked)
    bpy.context.object.location.x += 60
    return bpy.context.object


def save_beside_a_recording(tmp_path):
    """Save one/a.blend; one/ and two/ each hold a touch.h5."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "touch.h5").write_bytes(RECORDING.read_bytes())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "one" / "a.blend"))


def test_a_copy_with_its_parts_has_lights_of_its_own(gel, draw, part):
    before = draw(gel)
    copy = duplicate(gel, *gel.children_recursive)
    assert np.abs(draw(copy) - before).max() <= 1
    lamp = next(thing for thing in copy.children if thing.tactile.colour == "red")
    lamp.data.energy *= 2
    assert np.abs(draw(copy) - before)[..., 0].mean() > 10 and np.abs(draw(gel) - before).max() <= 1
    bpy.ops.tactile.set_up_render()  # for Cycles and EEVEE: what they light, and the coating that they drive
    body, driven_by = part("addon.objects.digit_body"), part("addon.objects.held_light").driven_by
    for thing in (gel, copy):
        leds = set(body.leds_of(thing).values())
        assert leds == driven_by(body.coating_of(thing)) & set(bpy.data.objects)
        assert all(led.light_linking.receiver_collection.objects.values() == [thing] for led in leds)
        assert all(each in thing.children for led in leds for each in led.light_linking.blocker_collection.objects)


def test_a_copy_of_the_same_mesh_leaves_the_gel_its_light(gel, part):
    copy = duplicate(gel, *gel.children_recursive, linked=True)
    bpy.ops.tactile.set_up_render()
    body, driven_by = part("addon.objects.digit_body"), part("addon.objects.held_light").driven_by
    for thing in (gel, copy):
        assert set(body.leds_of(thing).values()) == driven_by(body.coating_of(thing)) & set(bpy.data.objects)


def test_a_copied_pair_is_translated_by_itself(imported):
    skin = imported(frames="70:90")
    bpy.ops.tactile.translate()
    gel = bpy.context.object
    duplicate(skin, gel)
    for thing in bpy.context.selected_objects:
        thing.location.y = {"BIOTAC": 70, "DIGIT": 105}[thing.tactile.role]
    skin, copy = (bpy.context.scene.objects[f"{thing.name}.001"] for thing in (skin, gel))
    bpy.context.view_layer.objects.active, skin.tactile.frames = skin, "80:90"
    bpy.ops.tactile.translate()
    assert len(copy.data.shape_keys.key_blocks) == 11 < len(gel.data.shape_keys.key_blocks)


def test_a_copy_alone_has_the_calibration_s_lights_and_says_so(gel, draw, capfd):
    copy = duplicate(gel)
    drawn, coating = draw(copy), gel.material_slots[0].material
    bpy.ops.tactile.set_up_render()
    assert "DIGIT gel.001 came without its LEDs and camera" in capfd.readouterr().out
    assert np.abs(draw(copy) - drawn).max() <= 1
    own = copy.material_slots[0].material
    lamps = {target.id for curve in own.node_tree.animation_data.drivers for variable in curve.driver.variables
             for target in variable.targets}  # fmt: skip
    assert own != coating == gel.material_slots[0].material
    assert {thing for thing in copy.children if thing.tactile.role == "LED"} <= lamps


def test_a_gel_appended_alone_says_what_is_missing(gel, draw, tmp_path, capfd):
    bpy.data.objects["LED red"].data.energy *= 2
    whole = draw(gel)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "a.blend")) as (_, wanted):
        wanted.objects = ["DIGIT gel"]
    alone = wanted.objects[0]
    bpy.context.scene.collection.objects.link(alone)
    bpy.context.scene.frame_set(80)
    assert np.abs(draw(alone) - whole).max() <= 1
    bpy.ops.tactile.set_up_render()
    assert "append its collection" in capfd.readouterr().out
    assert np.abs(draw(alone) - whole).max() <= 1
    assert sum(thing.tactile.role == "LED" for thing in bpy.context.scene.objects) == 3


@pytest.mark.skipif(bpy.app.version < (4, 3), reason="Blender tells of what is appended from 4.3 on")
def test_an_appended_recording_is_that_of_its_own_blend(imported, tmp_path):
    """Both .blends have a touch.h5 beside them."""
    save_beside_a_recording(tmp_path)
    skin = imported(filepath=str(tmp_path / "one" / "touch.h5"), frames="70:90")
    assert skin.tactile.recording == "//touch.h5"
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two" / "b.blend"))
    with bpy.data.libraries.load(str(tmp_path / "one" / "a.blend")) as (_, wanted):
        wanted.objects = ["BioTac skin"]
    assert wanted.objects[0].tactile.recording == str(tmp_path / "one" / "touch.h5")


@pytest.mark.skipif(bpy.app.version < (4, 3), reason="Blender tells of what is pasted from 4.3 on")
def test_a_pasted_pair_is_translated_again_by_its_own_recording(imported, tmp_path):
    """The folder that it is pasted to has another touch.h5."""
    save_beside_a_recording(tmp_path)
    imported(filepath=str(tmp_path / "one" / "touch.h5"), frames="70:90")
    bpy.ops.tactile.translate()
    bpy.ops.object.select_all(action="DESELECT")
    for thing in bpy.context.scene.objects:
        thing.select_set(thing.tactile.role in ("BIOTAC", "DIGIT"))
    bpy.ops.view3d.copybuffer()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two" / "b.blend"))
    bpy.ops.view3d.pastebuffer()
    scene = bpy.context.scene
    bpy.context.view_layer.objects.active = skin = scene.objects["BioTac skin"]
    assert skin.tactile.recording == str(tmp_path / "one" / "touch.h5")
    bpy.ops.tactile.translate()
    assert [thing.name for thing in scene.objects if thing.tactile.role == "DIGIT"] == ["DIGIT gel"]
    assert not scene.collection.children


@pytest.mark.skipif(bpy.app.version < (4, 3), reason="Blender tells of what is appended from 4.3 on")
def test_appended_leds_leave_the_user_s_own_collection_in_its_place(gel, tmp_path):
    """The collections by which the extension links light are put beside the gel; this one is in the scene."""
    home, red = gel.users_scene[0].collection.children[0], bpy.data.objects["LED red"]
    mine = red.light_linking.receiver_collection = bpy.data.collections.new("Mine")
    mine.objects.link(gel)
    home.children.link(mine)
    name = home.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.append(directory=f"{tmp_path / 'a.blend'}/Collection/", filename=name)
    groups = {group.name: group for group in bpy.context.scene.collection.children_recursive}
    assert "Mine" in groups and not [each for each in groups if each.startswith("DIGIT ")]


def test_a_library_override_is_lit_when_it_is_opened_again(gel, draw, tmp_path):
    """Its LEDs' collections are no part of it to Blender, which then made a gel of their own for them."""
    before, name = draw(gel), gel.users_scene[0].collection.children[0].name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "user.blend"))
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.collections = [name]
    wanted.collections[0].override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    with pytest.raises(RuntimeError, match=r"linked from library\.blend"):
        bpy.ops.tactile.reset_to_calibration()  # Blender would not keep it
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "user.blend"))
    bpy.context.scene.frame_set(80)
    gel = next(thing for thing in bpy.context.scene.objects if thing.tactile.role == "DIGIT")
    assert "Tactile style" in gel.modifiers and np.abs(draw(gel) - before).max() <= 1


def test_a_linked_gel_plays_the_cache_beside_its_own_blend(imported, part, tmp_path):
    """Its picture was refused, as the cache was looked for beside the .blend that links it."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    imported(frames="70:72", motion="MESH_CACHE")
    bpy.ops.tactile.translate()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "user.blend"))
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, taken):
        taken.objects = ["DIGIT gel"]
    (tmp_path / "elsewhere").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "elsewhere" / "user.blend"))
    part("addon.objects.mesh_cache").check(*taken.objects)
    assert not (tmp_path / "elsewhere" / "tactile_cache").exists()


def test_an_instance_is_told_from_a_gel(gel, draw, tmp_path):
    before, group = draw(gel), bpy.context.scene.collection.children[0]
    bpy.context.scene.collection.children.unlink(group)
    holder = bpy.data.objects.new("holder", None)
    holder.instance_type, holder.instance_collection = "COLLECTION", group
    bpy.context.scene.collection.objects.link(holder)
    with pytest.raises(RuntimeError, match=f"holder: an instance of a gel.*collection {group.name}"):
        bpy.ops.tactile.set_up_render()
    bpy.context.scene.collection.children.link(group)
    bpy.context.scene.frame_set(80)
    assert np.abs(draw(gel) - before).max() <= 1


@pytest.mark.parametrize("applied", ["location", "rotation", "scale"])
def test_a_sensor_whose_place_was_applied_to_its_mesh_is_advised_on(gel, draw, part, applied):
    skin = next(thing for thing in bpy.context.scene.objects if thing.tactile.role == "BIOTAC")
    draw(gel)  # moved as an object, it is right
    for thing, press in ((gel, lambda: draw(gel)), (skin, bpy.ops.tactile.translate)):
        bpy.ops.object.select_all(action="DESELECT")
        thing.select_set(True)
        bpy.context.view_layer.objects.active = thing
        thing.location, thing.rotation_euler, thing.scale = (0, 0, 2), (0, 0, 0.2), (1.1, 1.1, 1.1)
        bpy.ops.object.transform_apply(**dict.fromkeys(("location", "rotation", "scale"), False) | {applied: True})
        with pytest.raises(Exception, match=f"{thing.name}: its mesh lies .* was applied.*Undo that"):
            press()
