"""Styles: the dent in colours, drawn larger than it is, and a picture that stays the true gel's."""

import bpy
import numpy as np
import pytest
from mathutils import Vector


@pytest.fixture
def gel(pressed_gel):
    return pressed_gel


def shown(gel, name, width, field):
    mesh = gel.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    values = np.empty(len(mesh.vertices) * width, np.float32)
    mesh.attributes[name].data.foreach_get(field, values)
    return values.reshape(-1, width)


def test_the_colours_follow_the_displacement(gel, part):
    true = part("addon.objects.digit_objects").displacement_of(gel, bpy.context.evaluated_depsgraph_get())
    assert bpy.ops.tactile.set_style(style="DISPLACEMENT") == {"FINISHED"}
    colours, length = shown(gel, "Tactile colour", 4, "color"), np.linalg.norm(true, axis=1)
    far, still = length.argmax(), length < 0.01 * length.max()
    assert colours[far, 0] > 0.3 and colours[far, 2] < 0.3  # green to yellow
    assert still.any() and np.ptp(colours[still, :3], axis=1).max() < 0.2  # grey


def test_colours_fade_below_the_expected_error(gel, part):
    true = part("addon.objects.digit_objects").displacement_of(gel, bpy.context.evaluated_depsgraph_get())
    for _ in range(2):  # a style that takes its own place is driven once
        bpy.ops.tactile.set_style(style="DISPLACEMENT")
    colours, length = shown(gel, "Tactile colour", 4, "color"), 1e6 * np.linalg.norm(true, axis=1)
    below = length < 0.2 * gel["expected_error_um"]
    assert below.any() and np.abs(colours[below, :3] - [0.5, 0.5, 0.53]).max() < 0.2
    assert len(gel.animation_data.drivers) == 1


NEW_FILE = (7.3589, -6.9258, 4.9583)  # of its hidden camera, inside the skin: nothing is looked at by it
OTHER = (0, 205, -25)  # in a sensor of another recording, straight up
VIEWS = [(150, -60, 100), (-150, 20, 60), (10, 200, 30), (60, 35, -150), NEW_FILE, OTHER, None]


@pytest.mark.parametrize("place", VIEWS)
def test_legends_face_the_camera_below_their_sensors_and_apart(gel, nodes_of, place):
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    scene, camera = bpy.context.scene, None
    layout = bpy.data.screens["Layout"]
    view = next(area for area in layout.areas if area.type == "VIEW_3D").spaces.active.region_3d
    turn = np.array(view.view_rotation.to_matrix())  # of a new file
    if place is not None:
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        scene.collection.objects.link(camera)
        camera.location = place
        looks = gel.location if place != OTHER else camera.location + Vector((0, 0, 1))
        camera.rotation_euler = (Vector(place) - looks).to_track_quat("Z", "Y").to_euler()
        scene.camera = camera
        bpy.context.view_layer.update()
        turn = turn if place in (NEW_FILE, OTHER) else np.array(camera.matrix_world.to_3x3())
    boxes = []
    for sensor in (thing for thing in scene.objects if thing.tactile.role in ("BIOTAC", "DIGIT")):
        legend = next(thing for thing in sensor.children if "text" in thing)
        nodes = (nodes_of(legend) + np.array(sensor.location)) @ turn  # right, up, toward
        card, title = nodes[:4], nodes[4 : len(nodes) // 2]
        assert np.ptp(card[:, 2]) < 5e-3 and (title[:, 2] > card[0, 2]).all()  # flat (a turn of 4 digits over 20 mm)
        assert (card[1] - card[0])[0] > 10 and (card[3] - card[0])[1] > 5  # neither mirrored nor on its head
        body = (nodes_of(sensor) + np.array(sensor.location)) @ turn
        assert card[:, 1].max() < body[:, 1].min()
        boxes.append((card[:, :2].min(0), card[:, :2].max(0)))
    (low, high), (other_low, other_high) = boxes
    apart = np.maximum(low, other_low) > np.minimum(high, other_high)
    assert apart.any() or place == (10, 200, 30)  # along the line through both the sensors hide each other too


def test_a_dent_drawn_larger_leaves_the_picture_alone(gel, part, nodes_of):
    read = part("addon.objects.digit_objects").displacement_of
    before, nodes = read(gel, bpy.context.evaluated_depsgraph_get()), nodes_of(gel)
    bpy.ops.tactile.set_style(style="DISPLACEMENT", exaggeration=3.0)
    moved = np.abs(nodes_of(gel) - nodes).max()
    assert moved == pytest.approx(2e3 * np.abs(before).max(), rel=0.05)
    np.testing.assert_allclose(read(gel, bpy.context.evaluated_depsgraph_get()), before, atol=1e-8)
    dragged = gel.modifiers.new("from the asset library", "NODES")  # the picture was that of the larger dent
    dragged.node_group = part("addon.objects.style_nodes").group("CONTACT_PATCH")
    np.testing.assert_allclose(read(gel, bpy.context.evaluated_depsgraph_get()), before, atol=1e-8)


def test_styles_take_each_other_s_place(gel):
    for style in ("DISPLACEMENT", "CONTACT_PATCH", "NONE", "CONTACT_PATCH"):
        bpy.ops.tactile.set_style(style=style)
    assert [m.name for m in gel.modifiers].count("Tactile style") == 1
    colours, patch = shown(gel, "Tactile colour", 4, "color"), shown(gel, "contact_patch", 1, "value")[:, 0] > 0.5
    assert patch.any() and (colours[patch, 0] > 0.9).all() and (colours[~patch, 0] < 0.6).all()
    assert legend_of(gel) == ["orange: in contact"]
    skin = next(thing for thing in bpy.context.scene.objects if thing.tactile.role == "BIOTAC")
    assert skin.active_material.name == "Tactile object colour" and skin.color[3] < 0.5  # see-through
    depsgraph = bpy.context.evaluated_depsgraph_get()  # Solid views show what has no colours by its object's
    seen = {thing: thing.evaluated_get(depsgraph).data.color_attributes.active_color for thing in (skin, gel)}
    assert seen[skin] is None and seen[gel].name == "Tactile colour"
    bpy.ops.tactile.set_style(style="NONE")
    assert not [thing for thing in gel.children if thing.tactile.role == "LEGEND"]


@pytest.mark.parametrize(("largest", "ends"), [(0.0, None), (2.0, "2.0")])
def test_a_style_fits_what_is_translated_after_it_unless_set_by_hand(imported, part, largest, ends):
    skin = imported(frames="60:70")
    bpy.ops.tactile.translate()
    gel = bpy.context.scene.objects["DIGIT gel"]
    bpy.ops.tactile.set_style(style="DISPLACEMENT", largest=largest, exaggeration=2.0)
    light = gel.tactile.largest
    skin.tactile.frames = "70:90"
    bpy.ops.tactile.translate()
    assert gel.tactile.largest > 1.2 * light
    assert legend_of(gel)[-1] == (ends or f"{1e3 * gel.tactile.largest:.2f}")
    nodes = part("addon.objects.style_nodes")
    assert nodes.get_input(gel.modifiers["Tactile style"], nodes.EXAGGERATION) == pytest.approx(2.0)


def test_a_contact_patch_is_coloured_though_the_style_came_first(gel, part):
    gel.modifiers.remove(part("addon.objects.frame_attribute").modifier_of(gel, "contact_patch"))
    bpy.ops.tactile.set_style(style="CONTACT_PATCH")
    bpy.ops.tactile.translate()
    bpy.context.scene.frame_set(80)
    patch = shown(gel, "contact_patch", 1, "value")[:, 0] > 0.5
    assert patch.any() and (shown(gel, "Tactile colour", 4, "color")[patch, 0] > 0.9).all()


def test_electrodes_are_coloured_with_their_range(gel):
    skin = next(thing for thing in bpy.context.scene.objects if thing.tactile.role == "BIOTAC")
    assert bpy.ops.tactile.set_style(style="ELECTRODES") == {"FINISHED"}
    counts, near = (
        shown(skin, "electrode_counts", 1, "value")[:, 0],
        shown(skin, "electrode_distance", 1, "value")[:, 0],
    )
    electrode = np.array([value.value for value in skin.data.attributes["electrode"].data])
    for k in range(19):  # half floats in the packed image: 11 bits
        np.testing.assert_allclose(counts[electrode == k], skin["electrodes"][k], rtol=1e-3, atol=0.01)
    colours = shown(skin, "Tactile colour", 4, "color")
    strong = (np.abs(counts) > 0.5 * np.abs(skin["electrodes"]).max()) & (near < 1e-3)
    assert strong.any() and (np.sign(colours[strong, 0] - colours[strong, 2]) == np.sign(counts[strong])).all()
    np.testing.assert_allclose(colours[near > 2e-3, :3], [[0.5, 0.5, 0.53]] * (near > 2e-3).sum(), atol=1e-5)
    title, low, high = legend_of(skin)
    assert title == "change, counts" and int(high) == -int(low) >= int(np.abs(skin["electrodes"]).max())


def test_electrodes_need_a_recording(scene):
    bpy.ops.tactile.add_sensor(sensor="BIOTAC")
    with pytest.raises(RuntimeError, match="no electrodes' readings"):
        bpy.ops.tactile.set_style(style="ELECTRODES")


def test_an_arrow_stands_in_the_dent_and_follows_the_force(gel, part, nodes_of):
    assert bpy.ops.tactile.force_arrow(length=10.0) == {"FINISHED"}
    arrow = part("addon.objects.styles").arrow_of(gel)
    nodes, force = nodes_of(arrow), np.array(gel["force"])
    tip, tail = nodes[nodes[:, 2].argmin()], nodes[nodes[:, 2].argmax()]
    assert np.linalg.norm(np.ptp(nodes, axis=0)) > 9 * np.linalg.norm(force) > 1
    mesh = arrow.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert mesh.color_attributes.active_color.name == "Tactile colour"  # what Solid views show
    assert (tip - tail) @ force > 0.95 * np.linalg.norm(tip - tail) * np.linalg.norm(force)
    moved = part("addon.objects.digit_objects").displacement_of(gel, bpy.context.evaluated_depsgraph_get())
    deepest = nodes_of(gel)[np.linalg.norm(moved, axis=1).argmax()]
    assert np.linalg.norm(tip - deepest) < 3  # mm
    bpy.ops.tactile.force_arrow()
    assert part("addon.objects.styles").arrow_of(gel) is None


def legend_of(sensor):
    return next(list(thing["text"]) for thing in sensor.children if "text" in thing)
