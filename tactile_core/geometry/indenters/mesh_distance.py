"""Distance of a regular grid's nodes to a triangle mesh. Lengths in mm."""

from __future__ import annotations

import numpy as np

_BATCH = 20_000  # nodes at a time: about 100 MB
_CANDIDATES = 8
_NEAR_MM = 2.0  # deeper and farther out than contact solvers look; beyond, a coarser grid is interpolated
_COARSER = 4


def signed(triangles: np.ndarray, origin: np.ndarray, spacing: float, within: np.ndarray) -> np.ndarray:
    """Return the signed distance (shape) mm of nodes at ``origin`` + spacing * (i, j, k) to triangles (m, 3, 3) mm.

    within : bool (shape), true for nodes inside
    Triangles are cut into pieces of two spacings; a node looks at the triangles of its nearest pieces. Beyond 2 mm a
    grid four times coarser is interpolated by a cubic spline. What this costs in accuracy is measured when an indenter
    is made.
    """
    import scipy.ndimage
    import scipy.spatial

    middles, owner = _pieces(triangles, 2 * spacing)
    tree = scipy.spatial.cKDTree(middles)
    distance = _unsigned(triangles, tree, owner, origin, spacing, within.shape, _NEAR_MM)
    distance[within.ravel()] *= -1
    far = np.flatnonzero(np.isinf(distance))
    if len(far):
        shape = tuple((n + _COARSER - 2) // _COARSER + 1 for n in within.shape)
        coarse = _unsigned(triangles, tree, owner, origin, _COARSER * spacing, shape, np.inf).reshape(shape)
        kept = within[::_COARSER, ::_COARSER, ::_COARSER]
        coarse[tuple(slice(n) for n in kept.shape)] *= np.where(kept, -1, 1)  # nodes beyond the grid are outside
        coarse = scipy.ndimage.spline_filter(coarse, order=3, mode="mirror")
        for batch in np.array_split(far, len(far) // _BATCH + 1):
            places = np.stack(np.unravel_index(batch, within.shape)) / _COARSER
            distance[batch] = scipy.ndimage.map_coordinates(coarse, places, mode="mirror", prefilter=False)
    return distance.reshape(within.shape)


def _unsigned(triangles, tree, owner, origin, spacing, shape, bound: float) -> np.ndarray:  # noqa: ANN001 (cKDTree)
    """Distance of a grid's nodes, flat; inf beyond ``bound``."""
    import trimesh

    count = min(_CANDIDATES, tree.n)
    distance = np.full(np.prod(shape), np.inf)
    for start in range(0, len(distance), _BATCH):
        places = np.unravel_index(np.arange(start, min(start + _BATCH, len(distance))), shape)
        batch = origin + spacing * np.stack(places, axis=-1)
        near = tree.query(batch, count, distance_upper_bound=bound)[1].reshape(len(batch), count)
        known = np.flatnonzero(near[:, 0] < tree.n)
        near = np.where(near < tree.n, near, near[:, :1])[known]
        at = np.repeat(batch[known], count, axis=0)
        gap = np.linalg.norm(trimesh.triangles.closest_point(triangles[owner[near.ravel()]], at) - at, axis=1)
        distance[start + known] = gap.reshape(-1, count).min(axis=1)
    return distance


def _pieces(triangles: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Halve triangles across their longest edge until it is short; returns middles (k, 3) and triangles (k,)."""
    owner, middles, owners = np.arange(len(triangles)), [], []
    while len(triangles):
        sides = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
        done = sides.max(axis=1) <= longest
        middles.append(triangles[done].mean(axis=1))
        owners.append(owner[done])
        triangles, owner, worst = triangles[~done], owner[~done], sides[~done].argmax(axis=1)
        row = np.arange(len(triangles))
        a, b, c = (triangles[row, (worst + k) % 3] for k in range(3))
        half = (a + b) / 2
        triangles = np.concatenate([np.stack([a, half, c], axis=1), np.stack([half, b, c], axis=1)])
        owner = np.tile(owner, 2)
    return np.concatenate(middles), np.concatenate(owners)
