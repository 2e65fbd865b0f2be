"""The picture follows the scene, in place of one of another moment."""

import bpy
import numpy as np
import pytest


@pytest.fixture
def follow(pressed_gel, part):
    """``follow(frame)``: what a window's handlers do, and the picture (H W, 3) as it is then seen."""
    preview = part("addon.operators.preview")

    def look(frame=None):
        if frame is not None:
            bpy.context.scene.frame_set(frame)
        preview.follow(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
        return np.array(bpy.data.images["DIGIT picture"].pixels[:]).reshape(-1, 4)[:, :3]

    return look


def test_another_frame_draws_its_own_picture(follow, pressed_gel, draw):
    pressed, resting = follow(), follow(70)
    np.testing.assert_allclose(resting, seen(draw(pressed_gel)), atol=1e-6)
    assert np.abs(pressed - resting).max() > 0.05  # ten levels
    np.testing.assert_array_equal(follow(80), pressed)


def seen(picture):
    """Its levels as an image of Blender's holds them."""
    return picture[::-1].reshape(-1, 3) / 255


def test_what_did_not_change_is_not_drawn_again(follow, part, monkeypatch):
    follow()
    monkeypatch.setattr(part("addon.operators.pictures"), "_drawn_of", None)
    bpy.data.objects["E1"].location.x += 1
    follow()
    assert not part("addon.operators.preview").failure()


def test_a_changed_lamp_draws_and_one_that_cannot_be_says_so(follow, part):
    bright = follow()
    bpy.data.lights["LED red"].energy *= 0.5
    assert follow().mean() < 0.95 * bright.mean()
    bpy.data.objects["LED red"].location.z += 100
    follow()
    assert "LED red" in part("addon.operators.preview").failure()


def test_an_opened_file_draws_the_frame_it_opens_on(follow, tmp_path):
    pressed = follow()
    bpy.context.scene.frame_set(70)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "touch.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "touch.blend"))
    resting = follow()
    assert np.abs(pressed - resting).max() > 0.05  # ten levels
    np.testing.assert_allclose(follow(80), pressed, atol=1 / 255)


def test_a_redone_translation_has_its_picture(follow):
    """Blender brings the image back without its pixels."""
    pressed = follow()
    bpy.ops.ed.undo_push(message="translated")
    bpy.data.objects.remove(bpy.context.scene.objects["DIGIT gel"])
    bpy.data.images.remove(bpy.data.images["DIGIT picture"])
    bpy.ops.ed.undo_push(message="deleted")
    bpy.ops.ed.undo()
    np.testing.assert_array_equal(follow(), pressed)


def test_an_image_editor_that_an_undo_empties_shows_the_picture(follow):
    (area,) = [area for area in bpy.context.screen.areas if area.type == "VIEW_3D"]
    area.type = "IMAGE_EDITOR"
    bpy.ops.ed.undo_push(message="translated")
    bpy.context.scene.objects["DIGIT gel"].location.x += 1
    bpy.ops.ed.undo_push(message="moved")
    area.spaces.active.image = None  # as Blender leaves it where the picture was of the other side alone
    bpy.ops.ed.undo()
    assert area.spaces.active.image == bpy.data.images["DIGIT picture"]


def test_gels_of_two_scenes_have_a_picture_each(follow, imported):
    first = bpy.context.scene.objects["DIGIT gel"].tactile.picture
    for kind in ("NEW", "FULL_COPY"):
        bpy.ops.scene.new(type=kind)
        if kind == "NEW":
            imported(frames="100:120")
        bpy.ops.tactile.translate()
    found = {thing.tactile.picture for thing in bpy.data.objects if thing.tactile.role == "DIGIT"}
    assert len(found) == 3 and first in found


def test_each_gel_has_a_picture_of_its_own(follow, imported, draw, part):
    first = follow()
    second = imported(frames="100:120", first_frame=-30)
    bpy.ops.tactile.translate()
    gels = [thing for thing in bpy.context.scene.objects if thing.tactile.role == "DIGIT"]
    gels[0].name = "mine"
    copy = gels[0].copy()
    second.users_collection[0].objects.link(copy)
    assert part("addon.objects.images").image_of(copy, "picture") is None
    follow(70)
    shown = [np.array(gel.tactile.picture.pixels[:]).reshape(-1, 4)[:, :3] for gel in gels]
    for gel, pixels in zip(gels, shown, strict=True):
        np.testing.assert_allclose(pixels, seen(draw(gel)), atol=1e-6)
    assert np.abs(shown[0] - shown[1]).max() > 0.05 < np.abs(shown[0] - first).max()
    assert gels[0].tactile.heights != gels[1].tactile.heights
