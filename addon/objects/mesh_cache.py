"""Write a long recording's movement, as it is translated, to a PC2 file that Blender's Mesh Cache modifier streams."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import bpy
import numpy as np

from ...tactile_core import sensors
from ...tactile_core.errors import TactileError
from ...tactile_core.files import atomic
from ...tactile_core.translation import gel_place
from ..settings import kept_files
from . import axes

_BLOCK = 64  # frames at a time


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """Movement of a surface: displacement (T, n, 3) m, or the ``file`` that holds it; the other is None.

    dent : (T,) m, each frame's largest displacement; patch : (T, n) bool, a gel's nodes in contact; None for a skin
    """

    dent: np.ndarray
    patch: np.ndarray | None
    displacement: np.ndarray | None = None
    file: Path | None = None


def in_memory(displacement: np.ndarray, sensor: str) -> Motion:
    """Return the ``Motion`` of a sensor's surface whose displacement (T, n, 3) m is kept in memory."""
    return Motion(_dent(displacement), _patch(displacement, sensor), displacement)


class Writer:
    """Writer of a surface's displacements, some frames at a time, into an open file."""

    def __init__(self, file: BinaryIO, sensor: str, per_metre: float, frames: int) -> None:
        """Write the header. frames : how many the file will hold; per_metre : Blender units in a metre"""
        self._sensor, self._per_metre, self._file = sensor, per_metre, file
        self._rest = axes.to_blender(sensors.sensor_surface(sensor).rest, per_metre)
        # PC2: "POINTCACHE2", version 1, points, first frame, frames per sample, samples; then float32 x, y, z
        self._file.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, len(self._rest), 0.0, 1.0, frames))
        self._dent: list[np.ndarray] = []
        self._patch: list[np.ndarray] = []

    def add(self, displacement: np.ndarray) -> None:
        """Write the next frames' displacement (T, n, 3) m."""
        nodes = self._rest + axes.to_blender(displacement, self._per_metre)
        self._file.write(np.ascontiguousarray(nodes, "<f4").data)
        self._dent.append(_dent(displacement))
        patch = _patch(displacement, self._sensor)
        self._patch += [] if patch is None else [patch]

    def motion(self, file: Path) -> Motion:
        """Return the movement that was written. file : the path at which the complete file will be"""
        patch = np.concatenate(self._patch) if self._patch else None
        return Motion(np.concatenate(self._dent), patch, file=file)


@contextlib.contextmanager
def writing(file: Path, sensor: str, per_metre: float, frames: int) -> Iterator[Writer]:
    """Yield the writer of a file, which appears complete or not at all. Raises TactileError if there is no room.
    frames : how many the file will hold; per_metre : Blender units in a metre"""
    room = atomic.writing(file, "room in a writable folder", "Save the .blend elsewhere")
    with room, atomic.new_file(file) as partial, open(partial, "wb") as stream:
        yield Writer(stream, sensor, per_metre, frames)
        stream.flush()


def written(moved: Motion, sensor: str, per_metre: float, name: str) -> Motion:
    """Write a movement that is in memory to a file in the caches' folder; return the movement in that file.
    per_metre : Blender units in a metre; name : begins the file's name"""
    if moved.file is not None:
        return moved
    token = hashlib.sha256(moved.displacement.tobytes()).hexdigest()[:8]
    file = kept_files.folder(kept_files.CACHE) / f"{bpy.path.clean_name(f'{name} {token}')}.pc2"
    with writing(file, sensor, per_metre, len(moved.displacement)) as writer:
        for start in range(0, len(moved.displacement), _BLOCK):
            writer.add(moved.displacement[start : start + _BLOCK])
    return dataclasses.replace(moved, displacement=None, file=file)


def play(thing: bpy.types.Object, file: Path, first: float, step: float) -> None:
    """Let an object play a file from the scene's frame ``first`` on; step : scene frames per frame of the file"""
    modifier = _player(thing) or thing.modifiers.new("Tactile", "MESH_CACHE")
    thing.modifiers.move(list(thing.modifiers).index(modifier), 0)  # what it moves is what the others show
    modifier.cache_format = "PC2"
    modifier.filepath = kept_files.shown(file)
    modifier.play_mode, modifier.time_mode = "SCENE", "FRAME"
    modifier.frame_start, modifier.frame_scale = first / step, 1.0 / step  # it scales before it subtracts
    modifier.forward_axis, modifier.up_axis = "POS_Y", "POS_Z"  # as the file holds them


def stop(thing: bpy.types.Object) -> None:
    """Let an object play no file any more."""
    modifier = _player(thing)
    if modifier is not None:
        thing.modifiers.remove(modifier)


def _player(thing: bpy.types.Object) -> bpy.types.Modifier | None:
    return next((each for each in thing.modifiers if each.type == "MESH_CACHE"), None)  # whatever its name is now


def check(*things: bpy.types.Object | None) -> None:
    """Raise TactileError if the mesh cache that moves one of these objects is missing at the path in the .blend."""
    for thing in filter(None, things):
        for modifier in thing.modifiers:
            if modifier.type != "MESH_CACHE":
                continue
            path = Path(bpy.path.abspath(modifier.filepath, library=thing.library))  # a linked object's file is there
            if not path.is_file():
                advice = f"Move the folder {kept_files.CACHE} with the .blend, or import or translate again"
                raise TactileError(thing.name, f"its mesh cache {path} is gone", "the file that moves it", advice)


def _dent(displacement: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("tni,tni->tn", displacement, displacement).max(axis=1))


def _patch(displacement: np.ndarray, sensor: str) -> np.ndarray | None:
    return gel_place.contact_patch(displacement, sensors.sensor_surface(sensor)) if sensors.is_gel(sensor) else None
