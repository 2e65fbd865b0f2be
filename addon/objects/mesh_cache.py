"""A long recording as a PC2 file that Blender's Mesh Cache modifier streams."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.files import atomic

FOLDER = "tactile_cache"
_BLOCK = 64  # frames at a time


def check(thing: bpy.types.Object) -> None:
    """Raise TactileError where the file that moves an object is not where the .blend looks for it."""
    for modifier in thing.modifiers:
        path = Path(bpy.path.abspath(modifier.filepath)) if modifier.type == "MESH_CACHE" else None
        if path is not None and not path.is_file():
            advice = f"Move the folder {FOLDER} with the .blend, or translate again"
            raise TactileError(thing.name, f"its mesh cache {path} is gone", "the file that moves it", advice)


def write_cache(thing: bpy.types.Object, rest: np.ndarray, displacement: np.ndarray, frames: np.ndarray) -> Path:
    """Write nodes = rest + displacement beside the .blend and let the object play them.

    rest : (n, 3), displacement : (T, n, 3), in the object's own units; frames : (T,), evenly spaced
    Raises TactileError where the .blend is not saved yet, or the folder cannot be written.
    """
    if not bpy.data.is_saved:
        raise TactileError(thing.name, "a mesh cache of an unsaved file", "a saved .blend", "Save it first")
    path = Path(bpy.path.abspath(f"//{FOLDER}")) / f"{bpy.path.clean_name(thing.name)}.pc2"
    first, step = float(frames[0]), float(frames[1] - frames[0]) if len(frames) > 1 else 1.0
    with atomic.writing(path, "room in a writable folder", "Save the .blend elsewhere"):
        path.parent.mkdir(exist_ok=True)
        with atomic.new_file(path) as partial, open(partial, "wb") as file:
            # PC2: "POINTCACHE2", version 1, points, first frame, frames a sample, samples; then float32 x, y, z
            file.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, len(rest), first, step, len(frames)))
            for start in range(0, len(frames), _BLOCK):
                nodes = rest.astype(np.float32) + displacement[start : start + _BLOCK]
                file.write(nodes.astype("<f4").tobytes())
    modifier = thing.modifiers.get("Tactile") or thing.modifiers.new("Tactile", "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.filepath = bpy.path.relpath(os.fspath(path))
    modifier.play_mode, modifier.time_mode = "SCENE", "FRAME"
    modifier.frame_start, modifier.frame_scale = first, 1.0
    modifier.forward_axis, modifier.up_axis = "POS_Y", "POS_Z"  # as the file holds them
    return path
