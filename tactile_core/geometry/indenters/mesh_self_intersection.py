"""Check whether a closed triangle mesh crosses itself."""

from __future__ import annotations

from typing import Any

import numpy as np

_FLAT = 1e-9  # of the longest edge cubed: volumes below are those of coplanar points and of touching ones
_PAIRS = 200_000  # candidate pairs looked at together: about 150 MB


def first_crossing(mesh: Any) -> np.ndarray | None:
    """Find a place (3,) mm where an edge goes through a triangle that is not its own, or None.

    Pairs come from an R-tree of the triangles' boxes. Pairs that share an edge can only cross by folding flat onto each
    other, which is not checked.
    """
    triangles, faces = mesh.triangles, mesh.faces
    for first, second in _near_pairs(mesh):
        shared = (faces[first][:, :, None] == faces[second][:, None, :]).any(axis=2).sum(axis=1)
        first, second = first[shared < 2], second[shared < 2]
        for one, other in ((first, second), (second, first)):
            for k in range(3):
                start, end = triangles[one, k], triangles[one, (k + 1) % 3]
                through = _goes_through(start, end, triangles[other])
                if through.any():
                    i = int(np.flatnonzero(through)[0])
                    return (start[i] + end[i]) / 2
    return None


def _near_pairs(mesh: Any):  # noqa: ANN202 (batches of two arrays of face numbers)
    tree, corners = mesh.triangles_tree, mesh.triangles
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1).tolist()
    first, second = [], []
    for i, box in enumerate(boxes):
        near = [j for j in tree.intersection(box) if j > i]
        first += [i] * len(near)
        second += near
        if len(first) > _PAIRS:
            yield np.array(first), np.array(second)
            first, second = [], []
    if first:
        yield np.array(first), np.array(second)


def _goes_through(start: np.ndarray, end: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mark the segments (n, 3), (n, 3) that pass strictly through triangles (n, 3, 3), by signed volumes."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    longest = np.max([np.linalg.norm(v, axis=1) for v in (end - start, b - a, c - b, a - c)], axis=0)
    least = _FLAT * longest**3
    above, below = _volume(a, b, c, start), _volume(a, b, c, end)
    around = np.stack([_volume(start, end, *side) for side in ((a, b), (b, c), (c, a))])
    opposite = (np.minimum(above, below) < -least) & (np.maximum(above, below) > least)
    return opposite & ((around > least).all(axis=0) | (around < -least).all(axis=0))


def _volume(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    return np.einsum("nd,nd->n", np.cross(b - a, c - a), d - a)
