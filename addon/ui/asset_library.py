"""The asset library "Tactile": the styles' node groups, to be dragged from an Asset Browser onto a sensor.

It is written by the Blender that will read it, into the extension's own folder, when the extension is switched on.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from ..objects import style_nodes
from ..settings.reports import TactileOperator

NAME = "Tactile"
_PACKAGE = __package__.rsplit(".", 2)[0]
_CATALOG = "7e0a52a2-5f4c-4c1b-9a55-1f6f0d0f6a29"
_CATALOGS = f"# Asset catalogs of the extension Tactile\n\nVERSION 1\n\n{_CATALOG}:Tactile:Tactile\n"
DESCRIPTIONS = {
    "DISPLACEMENT": "Colours a skin or a gel by how far each place has moved",
    "CONTACT_PATCH": "Colours what is touched of a gel",
    "ELECTRODES": "Colours a BioTac's skin round its electrodes by the change of each reading",
    "FORCE_ARROW": "For a mesh 1 unit high on its tip: follows a force, with its tip in a sensor's dent",
}


def folder() -> Path:
    """Return the library's folder; make it if it is missing."""
    return Path(bpy.utils.extension_path_user(_PACKAGE, path="assets", create=True))


def write(place: Path) -> Path:
    """Write styles.blend and its catalogue into a folder; returns the file's path.

    Node groups that the open file lacks are made for this and removed again; those that it has are no assets after it.
    """
    before = {*bpy.data.node_groups, *bpy.data.materials}
    groups = {style: style_nodes.group(style) for style in style_nodes.NAMES}
    for style, group in groups.items():
        group.asset_mark()
        group.asset_data.catalog_id, group.asset_data.description = _CATALOG, DESCRIPTIONS[style]
        group.asset_data.author = "Tactile"
        with bpy.context.temp_override(id=group):
            picture = Path(__file__).with_name("previews") / f"{style.lower()}.jpg"
            bpy.ops.ed.lib_id_load_custom_preview(filepath=str(picture))
    path = place / "styles.blend"
    partial = path.with_suffix(".partial.blend")
    bpy.data.libraries.write(str(partial), set(groups.values()), fake_user=True, compress=True)
    partial.replace(path)
    (place / "blender_assets.cats.txt").write_text(_CATALOGS, encoding="utf-8")
    for group in groups.values():
        group.asset_clear()
    for made in ({*bpy.data.node_groups} - before, {*bpy.data.materials} - before):
        bpy.data.batch_remove(made)
    return path


def entry() -> bpy.types.UserAssetLibrary | None:
    """Return the library's entry in Preferences > File Paths; None if it is not listed."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((each for each in libraries if Path(each.path) == folder()), None)


def install() -> None:
    """Write the library and list it."""
    write(folder())
    if entry() is None:
        bpy.context.preferences.filepaths.asset_libraries.new(name=NAME, directory=str(folder()))


class TACTILE_OT_install_styles(TactileOperator):
    """Write the asset library of the styles again, and list it in Preferences > File Paths"""

    bl_idname = "tactile.install_styles"
    bl_label = "Write Style Library"
    bl_options = {"REGISTER"}  # noqa: RUF012 (changes preferences, not the file)

    def _work(self, _context: bpy.types.Context) -> None:
        install()
        self.report({"INFO"}, f'Asset library "{NAME}": {folder()}')


def register() -> None:
    """Write and list the library a moment later: while extensions register, the open file cannot be reached."""
    if not bpy.app.background:
        bpy.app.timers.register(install)


def unregister() -> None:
    """Take the library off the list."""
    if bpy.app.timers.is_registered(install):
        bpy.app.timers.unregister(install)
    listed = entry()
    if listed is not None:
        bpy.context.preferences.filepaths.asset_libraries.remove(listed)


CLASSES = (TACTILE_OT_install_styles,)
