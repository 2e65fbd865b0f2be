"""A recording as shape keys: absolute keys along one curve, or a few basis keys with weights."""

from __future__ import annotations

import bpy
import numpy as np

from . import curves

COMPACT_KEYS = 64  # at most: each costs 0.1 ms a frame on 20,000 vertices (measured)
_ROUNDING = 1e-7  # of the largest eigenvalue: float32's own
COMPACT_ERROR = 10e-6  # m, largest error of a vertex that compact keys aim at: well below the translation's own


def write_absolute(thing: bpy.types.Object, rest: np.ndarray, displacement: np.ndarray, frames: np.ndarray) -> None:
    """Write one key a frame, shown one after the other by one F-curve of ``eval_time``.

    rest : (n, 3), displacement : (T, n, 3), in the object's own units; frames : (T,) of the scene
    """
    keys = _keys_of(thing)
    keys.use_relative = False
    nodes = rest.astype(np.float32)
    times = np.empty(len(frames))
    for k, moved in enumerate(displacement):
        block = thing.shape_key_add(name=f"{frames[k]:g}", from_mix=False)
        block.interpolation = "KEY_LINEAR"
        block.data.foreach_set("co", (nodes + moved).ravel())
        times[k] = block.frame  # steps of 10 that drift by rounding: read back, not counted
    curves.write_curve(keys, "eval_time", frames, times)


def write_compact(thing: bpy.types.Object, displacement: np.ndarray, frames: np.ndarray, tolerance: float) -> float:
    """Write few keys whose weighted sum is the displacement (proper orthogonal decomposition); return the error.

    displacement : (T, n, 3) in the object's own units; tolerance : the error aimed at, in the same
    """
    weights, shapes, error = decompose(displacement.reshape(len(displacement), -1), tolerance, COMPACT_KEYS)
    keys = _keys_of(thing)
    keys.use_relative = True
    rest = np.empty(displacement.shape[1] * 3, np.float32)
    keys.reference_key.data.foreach_get("co", rest)
    for k, shape in enumerate(shapes):
        block = thing.shape_key_add(name=f"Basis {k + 1}", from_mix=False)
        block.data.foreach_set("co", rest + shape)
        block.slider_min = -1.0
        curves.write_curve(keys, f'key_blocks["{block.name}"].value', frames, weights[:, k])
    return error


def decompose(rows: np.ndarray, tolerance: float, most: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Decompose rows (T, m) into weights (T, k) in -1..1 times shapes (k, m); also return a vertex's largest error.

    Enough shapes to bring that error below ``tolerance``, at most ``most``.
    """
    rows = np.asarray(rows, np.float32)
    values, vectors = np.linalg.eigh((rows @ rows.T).astype(np.float64))
    order = np.argsort(values)[::-1][: min(most, len(values))]
    order = order[values[order] > values.max() * _ROUNDING]
    weights = vectors[:, order].astype(np.float32)
    scale = np.abs(weights).max(axis=0, initial=0)
    weights, shapes = weights / scale, (weights * scale).T @ rows
    kept, left = 0, rows
    while kept < len(order) and _largest(left) > tolerance:
        kept = min(max(2 * kept, 8), len(order))  # doubled: each measure of the error is a pass over all frames
        left = rows - weights[:, :kept] @ shapes[:kept]
    return weights[:, :kept], shapes[:kept], _largest(left)


def _largest(rows: np.ndarray) -> float:
    """Largest length of the 3-vectors that the rows consist of."""
    return float(np.sqrt((rows.reshape(len(rows), -1, 3) ** 2).sum(-1).max(initial=0.0)))


def _keys_of(thing: bpy.types.Object) -> bpy.types.Key:
    if thing.data.shape_keys is None:
        thing.shape_key_add(name="Rest", from_mix=False)
    keys = thing.data.shape_keys
    for block in reversed(keys.key_blocks[1:]):
        thing.shape_key_remove(block)
    return keys
