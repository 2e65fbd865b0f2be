"""Find the example scenes: beside the package in a checkout and in Blender's extension, under ``share/`` of a wheel."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Sequence
from pathlib import Path

from ..errors import TactileError
from . import atomic
from .installed import PACKAGE

_SCENE = "scene.toml"
_ONE = f"press/{_SCENE}"  # by which the folder is known
_CACHES = shutil.ignore_patterns("__pycache__")
_INSTALLED = f"share/tactile/scenes/{_ONE}"  # as pyproject.toml's data-files have it


def folder() -> Path:
    """Return the folder of the example scenes. Raises TactileError if this installation has none."""
    beside = Path(__file__).resolve().parents[2] / "scenes"
    if (beside / _ONE).is_file():
        return beside
    for file in _installed_files():
        if file.as_posix().endswith(_INSTALLED) and file.is_file():
            return file.parents[1]
    raise TactileError("example scenes", "none in this installation", "a checkout or a wheel", "Install it again")


def described() -> list[str]:
    """Return a line for each scene: its name and its description."""
    found = {name: _about(folder() / name) for name in _names()}
    width = max(map(len, found))
    return [f"{name:<{width}}  {text}" for name, text in found.items()]


def copy(names: Sequence[str], out: str | Path) -> list[Path]:
    """Copy the scenes called `names`, or all if there are none, to ``out``/NAME, each whole; return these folders.
    Raises TactileError for unknown names, and for a folder that exists."""
    known = _names()
    for name in names:
        if name not in known:
            raise TactileError("scenes", f"no scene {name!r}", ", ".join(known))
    wanted = [Path(out) / name for name in dict.fromkeys(names or known)]
    for target in wanted:
        atomic.claim(target, "To copy it to another place: tactile scenes copy --out OTHER")
    for target in wanted:
        with atomic.writing(target), atomic.new_folder(target) as partial:
            shutil.copytree(folder() / target.name, partial, dirs_exist_ok=True, ignore=_CACHES)
    return wanted


def _names() -> list[str]:
    return sorted(each.name for each in folder().iterdir() if each.is_dir() and each.name[0] not in "._")


def _about(scene: Path) -> str:
    """Return a scene's description; of a folder without a scene, what it holds."""
    file = scene / _SCENE
    if not file.is_file():
        return ", ".join(sorted(each.name for each in scene.iterdir() if each.name[0] not in "._"))
    return str(tomllib.loads(file.read_text(encoding="utf-8")).get("description", ""))


def _installed_files() -> list[Path]:
    """Return the scene files of the installed package; none if it has no metadata."""
    from importlib import metadata

    try:
        listed = metadata.files(PACKAGE) or []
    except metadata.PackageNotFoundError:
        return []
    return [Path(str(file.locate())).resolve() for file in listed if file.name == _SCENE]
