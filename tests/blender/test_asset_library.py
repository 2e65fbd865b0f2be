"""The asset library of the styles: written by this Blender, listed, and of use without the add-on's code."""

from pathlib import Path

import bpy

NAMES = {"Tactile Displacement", "Tactile Contact Patch", "Tactile Electrodes", "Tactile Force Arrow"}


def test_the_library_is_listed_and_holds_the_styles_as_assets(part):
    library = part("addon.ui.asset_library")
    assert bpy.ops.tactile.install_styles() == {"FINISHED"}
    listed = [each for each in bpy.context.preferences.filepaths.asset_libraries if each.name == "Tactile"]
    assert [Path(each.path) for each in listed] == [library.folder()]
    assert not NAMES & {group.name for group in bpy.data.node_groups}
    catalogues = (library.folder() / "blender_assets.cats.txt").read_text()
    with bpy.data.libraries.load(str(library.folder() / "styles.blend"), assets_only=True) as (held, taken):
        taken.node_groups = list(held.node_groups)
    groups = {group.name: group for group in taken.node_groups}
    assert groups.keys() == NAMES
    assert all(tuple(group.preview.image_size) == (256, 256) for group in groups.values())
    assert all(group.asset_data.catalog_id in catalogues and group.is_modifier for group in groups.values())


def test_a_style_from_the_library_colours_a_sensor(part, scene):
    """As a user drags it: an appended group in a modifier, no operator of ours."""
    library = part("addon.ui.asset_library")
    path = library.write(library.folder())
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    gel = next(thing for thing in scene.objects if thing.tactile.role == "DIGIT")
    with bpy.data.libraries.load(str(path), assets_only=True) as (_, taken):
        taken.node_groups = ["Tactile Displacement"]
    modifier = gel.modifiers.new("dragged", "NODES")
    modifier.node_group = taken.node_groups[0]
    gel.shape_key_add(name="Basis")
    key = gel.shape_key_add(name="dent")
    key.value = 1.0
    key.data[1000].co.z -= 1.0
    mesh = gel.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    colours = mesh.attributes["Tactile colour"].data
    assert colours[1000].color[0] > 0.9 and colours[0].color[2] > 0.5  # the ramp's upper end at 1 unit; grey
    assert mesh.color_attributes.active_color.name == "Tactile colour"  # what Solid views show


def test_groups_that_the_open_file_holds_stay_no_assets(part, imported):
    imported(frames="70:90")
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    library = part("addon.ui.asset_library")
    library.write(library.folder())
    group = bpy.data.node_groups["Tactile Displacement"]
    assert group.asset_data is None and group.users
