"""Animate a surface in any of three ways, through one interface."""

from __future__ import annotations

import bpy
import numpy as np

from . import axes, mesh_cache, shape_keys


def animate(
    thing: bpy.types.Object, rest: np.ndarray, displacement: np.ndarray, frames: np.ndarray, motion: str
) -> str:
    """Let an object play displacements (T, n, 3) m of rest (n, 3) m at frames (T,); returns a sentence.

    motion : one of ``properties.MOTIONS``. Raises TactileError where a mesh cache cannot be written.
    """
    per_metre = thing.tactile.per_metre
    moved, nodes = axes.to_blender(displacement, per_metre), axes.to_blender(rest, per_metre)
    thing.tactile.motion = motion
    thing.tactile.largest = float(np.sqrt(np.square(displacement).sum(-1).max(initial=0.0)))
    if motion == "MESH_CACHE":
        path = mesh_cache.write_cache(thing, nodes, moved, frames)
        return f"{thing.name}: mesh cache {path.name}"
    if motion == "COMPACT":
        error = shape_keys.write_compact(thing, moved, frames, shape_keys.COMPACT_ERROR * per_metre)
        count = len(thing.data.shape_keys.key_blocks) - 1
        return f"{thing.name}: {count} basis keys, largest error {1e6 * error / per_metre:.1f} µm"
    shape_keys.write_absolute(thing, nodes, moved, frames)
    return f"{thing.name}: {len(frames)} shape keys"
