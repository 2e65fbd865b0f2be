"""Styles: the dent in colours, drawn larger than it is, and a picture that stays the true gel's."""

from __future__ import annotations

import bpy
import numpy as np
import pytest


@pytest.fixture
def gel(imported):
    imported(frames="70:90")
    bpy.ops.tactile.translate()
    bpy.context.scene.frame_set(80)
    return bpy.context.scene.objects["DIGIT gel"]


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


def test_a_dent_drawn_larger_leaves_the_picture_alone(gel, part, nodes_of):
    read = part("addon.objects.digit_objects").displacement_of
    before, nodes = read(gel, bpy.context.evaluated_depsgraph_get()), nodes_of(gel)
    bpy.ops.tactile.set_style(style="DISPLACEMENT", exaggeration=3.0)
    moved = np.abs(nodes_of(gel) - nodes).max()
    assert moved == pytest.approx(2e3 * np.abs(before).max(), rel=0.05)
    np.testing.assert_allclose(read(gel, bpy.context.evaluated_depsgraph_get()), before, atol=1e-8)


def test_styles_take_each_other_s_place(gel):
    for style in ("DISPLACEMENT", "CONTACT_PATCH", "NONE", "CONTACT_PATCH"):
        bpy.ops.tactile.set_style(style=style)
    assert [m.name for m in gel.modifiers].count("Tactile style") == 1
    colours, patch = shown(gel, "Tactile colour", 4, "color"), shown(gel, "contact_patch", 1, "value")[:, 0] > 0.5
    assert patch.any() and (colours[patch, 0] > 0.9).all() and (colours[~patch, 0] < 0.6).all()
    assert not [thing for thing in gel.children if thing.tactile.role == "LEGEND"]
