"""A scene as the text of a ``scene.toml`` that `scene.load_scene` reads back equal."""

from __future__ import annotations

import json
import os
import pathlib
from typing import Any

import msgspec

from ..files import atomic
from .scene import Scene


def to_toml(scene: Scene) -> str:
    """Write a scene as TOML text, with every field, defaults too."""
    document = msgspec.to_builtins(scene)
    lines = [f"{key} = {_value(document[key])}" for key in ("format", "name", "description")]
    for spec in document["indenters"]:
        lines += ["", "[[indenters]]", *_fields(spec)]
    if document["pairs"] is not None:
        lines += ["", "[pairs]", *_fields(document["pairs"])]
    if document["recording"] is not None:
        recording = dict(document["recording"])
        points = recording.pop("points")
        lines += ["", "[recording]", *_fields(recording), "points = ["]
        lines += [f"    {_value(point)}," for point in points] + ["]"]
    return "\n".join(lines) + "\n"


def write_scene(folder: str | os.PathLike, scene: Scene, meshes: dict[str, bytes]) -> pathlib.Path:
    """Write ``scene.toml`` and its mesh files (name -> content) into a folder; returns the file's path.

    Raises TactileError where the folder cannot be written.
    """
    folder = pathlib.Path(folder)
    with atomic.writing(folder, advice="Make room, or choose another one"):
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in meshes.items():
            atomic.write_bytes(folder / name, content)
        atomic.write_bytes(folder / "scene.toml", to_toml(scene).encode())
    return folder / "scene.toml"


def _fields(table: dict[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in table.items()]


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(_fields(value)) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    # JSON's strings and finite numbers are TOML's too; DEL alone must be escaped there and is not by JSON.
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")
