"""A picture of another moment than the scene shows is dimmed."""

from __future__ import annotations

import bpy
import numpy as np
import pytest


@pytest.fixture
def shown(imported, part):
    """What a window's handlers do, and the picture's pixels (H, W, 3) as they are seen."""
    imported(frames="70:90")
    bpy.ops.tactile.translate()
    stale = part("addon.operators.stale_picture")

    def look(frame=None):
        if frame is not None:
            bpy.context.scene.frame_set(frame)
        stale.check(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
        image = bpy.data.images["DIGIT picture"]
        return np.array(image.pixels[:]).reshape(-1, 4)[:, :3]

    return look, stale


def test_a_picture_of_another_frame_is_dim_until_the_frame_is_back(shown):
    look, stale = shown
    first = bpy.context.scene.frame_current
    bright = look()
    assert not stale.is_stale()
    np.testing.assert_allclose(look(70), stale.DIM * bright, atol=1 / 255)  # a level, of 8-bit images
    assert stale.is_stale()
    np.testing.assert_array_equal(look(first), bright)
    assert not stale.is_stale()


def test_a_changed_lamp_dims_the_picture_and_drawing_lights_it_again(shown, part):
    look, stale = shown
    bright = look()
    bpy.data.lights["LED red"].energy *= 0.5
    assert look().mean() < 0.5 * bright.mean() and stale.is_stale()
    gel = bpy.context.scene.objects["DIGIT gel"]
    part("addon.operators.pictures").update(gel, bpy.context.evaluated_depsgraph_get())
    assert look().mean() > 0.5 * bright.mean() and not stale.is_stale()


def test_a_saved_file_knows_whether_its_picture_is_of_its_frame(shown, tmp_path):
    look, _ = shown
    first, bright = bpy.context.scene.frame_current, look()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "fresh.blend"))
    look(70)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "stale.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "fresh.blend"))
    np.testing.assert_allclose(look(), bright, atol=1 / 255)
    assert look(70).mean() < 0.5 * bright.mean()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "stale.blend"))
    assert look(first).mean() < 0.5 * bright.mean()  # until it is drawn
