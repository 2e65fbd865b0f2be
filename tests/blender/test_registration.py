"""Switched off the extension leaves nothing in Blender, and switched on again it is whole."""

import bpy

LISTS = "save_pre", "load_pre", "load_post", "frame_change_post", "depsgraph_update_post"
MENUS = "TOPBAR_MT_file_import", "TOPBAR_MT_file_export", "VIEW3D_MT_add", "TOPBAR_MT_window"


def known(extension):
    """What of the extension Blender knows: classes, properties, handlers and functions that draw menu entries."""
    own = extension.__name__ + "."
    functions = [f for name in LISTS for f in getattr(bpy.app.handlers, name)]
    functions += [f for name in MENUS for f in getattr(getattr(bpy.types, name).draw, "_draw_funcs", ())]
    properties = [name for kind in (bpy.types.Object, bpy.types.Scene) for name in dir(kind) if "tactile" in name]
    classes = [name for name in dir(bpy.types) if name.startswith("TACTILE_")]
    return (
        sorted({f"{f.__module__}.{f.__name__}" for f in functions if f.__module__.startswith(own)}),
        properties,
        classes,
    )


def test_off_leaves_nothing_and_on_again_is_whole(extension, part):
    view = part("addon.operators.view")
    view.unregister()  # what a test before may have opened
    before = known(extension)
    functions, properties, classes = before
    assert {name.rpartition(".")[2] for name in functions} >= {"_menu", "_menu_import", "_menu_export", "pack"}
    assert properties == ["tactile", "tactile_render"] and "TACTILE_PT_recording" in classes
    view._stand_first()  # for two seconds a class more, as where the tab is opened in an older Blender
    extension.unregister()
    try:
        assert known(extension) == ([], [], [])
        assert not bpy.app.timers.is_registered(view._stand_back)
    finally:
        extension.register()
    assert known(extension) == before


def test_no_button_takes_another_meaning_in_another_language(extension):
    """Translate was to move in Blender's French and Spanish, the preset Fast to paste in its German."""
    buttons = [kind for name in dir(bpy.types) if name.startswith("TACTILE_OT_") and (kind := getattr(bpy.types, name))]
    preset = bpy.types.Scene.bl_rna.properties["tactile_render"].fixed_type.properties["preset"]
    assert {kind.bl_rna.translation_context for kind in buttons} == {preset.translation_context} == {"Tactile"}
