"""Animate a surface: a shape key per frame, or a mesh cache beside the .blend."""

from __future__ import annotations

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ..settings import properties
from . import axes, curves, mesh_cache, style_nodes

_APPLIED = 1e-4  # m, median shift of nodes that shows a mesh moved as a whole: no dent is as wide (assumed)


def check_rest(*things: bpy.types.Object) -> None:
    """Raise TactileError for a sensor that does not play: in Edit Mode, where it takes no keys either, with a shape key
    pinned, or with relative ones; and for one whose mesh was moved within the object, as Apply Location does: all
    places would be off."""
    for thing in things:
        if thing.mode == "EDIT":
            found = "in Edit Mode, where it is at rest"
            raise TactileError(thing.name, found, "Object Mode", "Press Tab over the 3D view")
        keys = thing.data.shape_keys
        animation = keys and keys.animation_data
        plays = animation and (animation.action or animation.nla_tracks)
        if plays and (thing.show_only_shape_key or keys.use_relative):
            found = "one of its shape keys is pinned" if thing.show_only_shape_key else "its shape keys are relative"
            advice = "Undo that in Properties > Data > Shape Keys"
            raise TactileError(thing.name, f"{found}: it does not move", "keys that are played in turn", advice)
        own = np.empty(3 * len(thing.data.vertices), np.float32)
        (keys.reference_key.data if keys else thing.data.vertices).foreach_get("co", own)
        rest, nodes = properties.surface_of(thing).rest, axes.to_sensor(own.reshape(-1, 3), thing.tactile.per_metre)
        advice = "Undo that (Ctrl Z), or delete the sensor and import, translate or add it again"
        if nodes.shape != rest.shape:
            raise TactileError(thing.name, f"a mesh of {len(nodes)} vertices", f"the sensor's {len(rest)}", advice)
        off = np.median(np.linalg.norm(nodes - rest, axis=1))
        if off > _APPLIED:
            found = f"its mesh lies {1e3 * off:.1f} mm off the sensor's own: a location, rotation or scale was applied"
            raise TactileError(thing.name, found, "a sensor moved as an object", advice)


def animate(thing: bpy.types.Object, moved: mesh_cache.Motion, frames: np.ndarray, motion: str) -> str:
    """Let an object play a movement at frames (T,) of the scene; return words for the user on what plays it.

    motion : "SHAPE_KEYS" or "MESH_CACHE"; "", which older files have for compact keys, stands for "SHAPE_KEYS"
    Raises TactileError if a mesh cache cannot be written.
    """
    about = thing.tactile
    about.motion = motion = motion or "SHAPE_KEYS"
    about.largest = float(moved.dent.max(initial=0.0))
    nodes = axes.to_blender(properties.surface_of(thing).rest, about.per_metre)
    _lay_at_rest(thing.data, nodes)
    if motion == "MESH_CACHE":
        moved = mesh_cache.written(moved, properties.sensor_name(thing), about.per_metre, thing.name)
        mesh_cache.play(thing, moved.file, frames[0], frames[1] - frames[0] if len(frames) > 1 else 1.0)
        return f"{thing.name}: mesh cache {moved.file.name}"
    mesh_cache.stop(thing)
    _write_keys(thing, nodes, axes.to_blender(moved.displacement, about.per_metre), frames)
    return f"{thing.name}: {len(frames)} shape keys"


def played(thing: bpy.types.Object) -> tuple[float, float] | None:
    """Return the first and last frame of the animation of an object's surface; None if it may move at any frame.

    That is so without an animation, or if its F-curve is extrapolated or repeated. Keys of its place do not count."""
    keys = thing.data.shape_keys
    owner, path = (keys, "eval_time") if keys else (thing, '["dent_um"]')
    moves = owner.animation_data
    if moves is None or moves.action is None or getattr(moves, "action_slot", moves) is None:
        return None
    curve = curves.fcurves_of(owner).find(path)
    if curve is None or curve.modifiers or curve.extrapolation != "CONSTANT":
        return None
    first, last = curve.range()
    return first, last


def _lay_at_rest(mesh: bpy.types.Mesh, nodes: np.ndarray) -> None:
    """Put a mesh's own vertices to nodes (n, 3) in its units, and remove the dent that Blender's Convert to Mesh or an
    applied shape key has left: styles and pictures would take it for every frame's."""
    if style_nodes.DISPLACEMENT in mesh.attributes:
        mesh.attributes.remove(mesh.attributes[style_nodes.DISPLACEMENT])
    for points in (mesh.vertices, *([mesh.shape_keys.reference_key.data] if mesh.shape_keys else [])):
        points.foreach_set("co", np.ascontiguousarray(nodes, np.float32).ravel())


def _write_keys(thing: bpy.types.Object, rest: np.ndarray, displacement: np.ndarray, frames: np.ndarray) -> None:
    """Write one shape key per frame, and the F-curve of ``eval_time`` that shows one after the other.

    rest : (n, 3), displacement : (T, n, 3), in the object's own units; frames : (T,) of the scene
    """
    if thing.data.shape_keys is None:
        thing.shape_key_add(name="Rest", from_mix=False)
    keys = thing.data.shape_keys
    for block in reversed(keys.key_blocks[1:]):
        thing.shape_key_remove(block)
    keys.use_relative = False
    nodes = rest.astype(np.float32)
    times = np.empty(len(frames))
    for k, moved in enumerate(displacement):
        block = thing.shape_key_add(name=f"{frames[k]:g}", from_mix=False)
        block.interpolation = "KEY_LINEAR"
        block.data.foreach_set("co", (nodes + moved).ravel())
        times[k] = block.frame  # steps of 10 that drift by rounding: read back, not counted
    curves.write_curve(keys, "eval_time", frames, times)
