"""Keep the files that belong to a .blend: in folders beside it, or in Blender's own until the .blend is saved."""

import filecmp
import itertools
import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from . import preferences

CACHE, SIMULATIONS = "tactile_cache", "tactile_simulations"
# By the save that is going on: what held which path, and the file if it was Blender's own.
_named: list[tuple[bpy.types.bpy_struct, str, str, Path | None]] = []
_PATHS = "recording", "columns", "unit", "weights"  # properties of a skin
_DAYS = 30  # that files of a .blend which was never saved are kept (assumed)


def folder(name: str) -> Path:
    """Return the folder ``name``, CACHE or SIMULATIONS, beside the .blend, which may not exist. For a .blend that was
    never saved, return Blender's own folder, and remove mesh caches in it that are older than _DAYS."""
    if bpy.data.is_saved:
        return Path(bpy.path.abspath(f"//{name}"))
    for old in _own(name).glob("*.pc2"):
        if time.time() - old.stat().st_mtime > _DAYS * 86400:
            old.unlink()
    return _own(name)


def _own(name: str) -> Path:
    """Return the folder for files of a .blend that was never saved. Mesh caches must outlast Blender there, as a .blend
    that is recovered after a crash needs them."""
    if name == SIMULATIONS:
        return Path(bpy.app.tempdir) / name
    return Path(bpy.utils.extension_path_user(preferences.ID, path=name))


def shown(file: Path) -> str:
    """Return a file's path as the .blend holds it: relative to the .blend if that was saved."""
    return _relative(file, Path(bpy.data.filepath).parent) if bpy.data.is_saved else os.fspath(file)


def _held() -> Iterator[tuple[bpy.types.bpy_struct, str, str]]:
    """Yield, for each path in the .blend, the owner, the name of its property, and the name of the folder it is for.
    Paths of linked objects start from their own .blend."""
    for thing in (each for each in bpy.data.objects if each.library is None):
        for name in _PATHS:
            if getattr(thing.tactile, name):
                yield thing.tactile, name, SIMULATIONS
        for modifier in thing.modifiers:
            if modifier.type == "MESH_CACHE":
                yield modifier, "filepath", CACHE


@persistent
def _copy_beside(file: str, *_: object) -> None:
    """Copy a .blend's files to where it will be saved, make paths relative to there; Blender calls it before."""
    _named.clear()
    here, there = Path(bpy.data.filepath).parent if bpy.data.is_saved else None, Path(file).parent
    moves = file and not (here and there.exists() and here.samefile(there))
    for holder, name, kind in _held() if moves else ():
        value = getattr(holder, name)
        path = Path(os.path.normpath(bpy.path.abspath(value)))
        own = path.parent == _own(kind)
        if not (own or (here and value.startswith("//"))) or not path.exists():
            continue
        _named.append((holder, name, value, path if own else None))
        if own or path.parent == here / kind:
            path = copied(path, there / kind)
        # Blender itself turns a modifier's relative path to where it saves, but no add-on's.
        setattr(holder, name, _relative(path, here if here and kind == CACHE else there))


def copied(path: Path, folder: Path) -> Path:
    """Put a file into a folder and return its path there. It gets a new name if another .blend's file has its own.

    A hard link will do: the add-on never changes a file but replaces it, so that another link keeps the old bytes.
    """
    folder.mkdir(exist_ok=True)
    names = itertools.chain([path.name], (f"{path.stem}_{n}{path.suffix}" for n in itertools.count(2)))
    beside = next(file for file in (folder / name for name in names) if not file.exists() or _same(path, file))
    if not beside.exists():
        try:
            os.link(path, beside)
        except OSError:  # on another disk
            shutil.copyfile(path, beside)
    return beside


def _same(one: Path, other: Path) -> bool:
    return one.samefile(other) or filecmp.cmp(one, other, shallow=False)


def _relative(path: Path, start: Path) -> str:
    try:
        return f"//{os.path.relpath(path, start)}"
    except ValueError:  # another drive of Windows
        return os.fspath(path)


@persistent
def _let_go(file: str, *_: object) -> None:
    """Remove files from Blender's own folder that now lie beside the .blend, or, after a copy was saved, give the open
    .blend its paths back; Blender calls it after a save."""
    copied = not bpy.data.is_saved or Path(file) != Path(bpy.data.filepath)
    for holder, name, value, own in _named:
        if copied:
            setattr(holder, name, value)
        elif own is not None:
            own.unlink(missing_ok=True)
    _named.clear()
    _find_again()


@persistent
def _find_again(*_: object) -> None:
    """Correct paths of files that have moved: an undo or an opened .blend brings their former paths back."""
    for holder, name, kind in _held():
        path = Path(bpy.path.abspath(getattr(holder, name)))
        if path.is_file() and (bpy.data.is_saved or path.is_absolute()):
            setattr(holder, name, getattr(holder, name))  # drawn anew: before the save its folder was not known
            continue
        for place in (Path(bpy.path.abspath(f"//{kind}")) if bpy.data.is_saved else None, _own(kind)):
            if place is not None and (place / path.name).is_file():
                setattr(holder, name, shown(place / path.name))
                break


@persistent
def _name_from_there(context: "bpy.types.BlendImportContext") -> None:  # quoted: Blender 4.2 has no such type
    """Make appended objects' paths absolute: relative to this .blend, they could mean another file."""
    for item in context.import_items:
        if item.id_type == "OBJECT" and item.id is not None and item.id.library is None and item.source_library:
            about, folder = item.id.tactile, item.id.tactile.folder or None
            for name in _PATHS:
                held = getattr(about, name)
                # Pasted, it came by way of a file of Blender's own: only the folder says where from.
                places = bpy.path.abspath(held, library=item.source_library), bpy.path.abspath(held, start=folder)
                path = next((os.path.normpath(place) for place in places if place and os.path.exists(place)), None)
                if path and path != os.path.normpath(bpy.path.abspath(held)):
                    setattr(about, name, path)


HANDLERS = (
    (bpy.app.handlers.save_pre, _copy_beside), (bpy.app.handlers.save_post, _let_go),
    (bpy.app.handlers.save_post_fail, _let_go),
    (bpy.app.handlers.load_post, _find_again), (bpy.app.handlers.undo_post, _find_again),
    (bpy.app.handlers.redo_post, _find_again),
    *([(bpy.app.handlers.blend_import_post, _name_from_there)] if bpy.app.version >= (4, 3, 0) else []),
)  # fmt: skip
