"""Files that belong to a .blend: in folders beside it, and where Blender keeps them until it is saved."""

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from . import preferences

CACHE, SIMULATIONS = "tactile_cache", "tactile_simulations"
_copied: list[Path] = []  # by the save that is going on
_DAYS = 30  # that files of a .blend which was never saved are kept (assumed)


def folder(name: str) -> Path:
    """Return one of the folders, made or not: beside the .blend; of one that was never saved, Blender's own."""
    if bpy.data.is_saved:
        return Path(bpy.path.abspath(f"//{name}"))
    for old in _own(name).glob("*.pc2"):
        if time.time() - old.stat().st_mtime > _DAYS * 86400:
            old.unlink()
    return _own(name)


def _own(name: str) -> Path:
    """Return where files of a .blend that was never saved are: mesh caches outlast Blender, for its recovered files."""
    if name == SIMULATIONS:
        return Path(bpy.app.tempdir) / name
    return Path(bpy.utils.extension_path_user(preferences.ID, path=name))


def shown(file: Path) -> str:
    """Return a file's path as a .blend holds it: relative, where that is saved."""
    return bpy.path.relpath(os.fspath(file)) if bpy.data.is_saved else os.fspath(file)


def _held() -> Iterator[tuple[bpy.types.bpy_struct, str, str]]:
    """Yield what holds a path, by which name, and which folder it belongs in."""
    for thing in bpy.data.objects:
        if thing.tactile.recording:
            yield thing.tactile, "recording", SIMULATIONS
        for modifier in thing.modifiers:
            if modifier.type == "MESH_CACHE":
                yield modifier, "filepath", CACHE


@persistent
def _move_beside(file: str, *_: object) -> None:
    """Copy the files of a .blend that is saved for the first time beside it; called by Blender before it saves."""
    for holder, name, kind in _held() if file else ():
        path = Path(getattr(holder, name))
        if path.is_absolute() and path.parent == _own(kind) and path.is_file():
            beside = Path(file).parent / kind / path.name
            beside.parent.mkdir(exist_ok=True)
            beside.unlink(missing_ok=True)
            try:
                os.link(path, beside)
            except OSError:  # on another disk
                shutil.copyfile(path, beside)
            setattr(holder, name, f"//{kind}/{path.name}")
            _copied.append(path)


@persistent
def _let_go(*_: object) -> None:
    """Remove what lies beside the .blend now; but of a copy, whose own file stays unsaved, it is named again."""
    _find_again()
    for path in _copied if bpy.data.is_saved else ():
        path.unlink(missing_ok=True)
    _copied.clear()


@persistent
def _find_again(*_: object) -> None:
    """Name files again that are elsewhere now: a copy was saved, an undo or a .blend named their former place."""
    for holder, name, kind in _held():
        path = Path(bpy.path.abspath(getattr(holder, name)))
        if path.is_file() and (bpy.data.is_saved or path.is_absolute()):
            setattr(holder, name, getattr(holder, name))  # drawn anew: before the save its folder was not known
            continue
        for place in (Path(bpy.path.abspath(f"//{kind}")) if bpy.data.is_saved else None, _own(kind)):
            if place is not None and (place / path.name).is_file():
                setattr(holder, name, shown(place / path.name))
                break


HANDLERS = (
    (bpy.app.handlers.save_pre, _move_beside), (bpy.app.handlers.save_post, _let_go),
    (bpy.app.handlers.load_post, _find_again), (bpy.app.handlers.undo_post, _find_again),
    (bpy.app.handlers.redo_post, _find_again),
)  # fmt: skip
