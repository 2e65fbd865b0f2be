"""Build the smooth grid of a mesh's signed distance, and measure an indenter's error against its mesh."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from ...errors import TactileError
from .spline_grid import BAND, SplineGrid, TipGrid

MARGIN = 1e-3  # m, how far the grid reaches beyond the body
MAX_NODES = 8_000_000  # 32 MB kept, about 300 MB while it is built
_STEP_UP = 1.1  # step in the search of a spacing
REACH = 5e-3  # m above the lowest point: deeper than any dent of a gel or skin (assumed)
_STEM = 4  # times the spacing, at least, beyond what may touch
_SPARE = 6  # nodes more on every side while the spline is fitted: what it assumes at its ends fades by 0.27 a node
_FINEST = 0.1e-3  # m: finer than the nodes of either sensor
_CHECKED = 500  # points near the surface at which the error is measured
_CHECKED_WITHIN_MM = 0.3  # how near
_BATCH = 20_000  # nodes at a time: about 100 MB
_CANDIDATES = 8
_NEAR_MM = 2.0  # deeper and farther out than contact solvers look; beyond, a coarser grid is interpolated
_COARSER = 4
# Columns stand this part of the spacing beside the nodes, so that none meets an edge or a vertex; tried in turn.
_BESIDE = ((1.234e-4, 0.876e-4), (-0.543e-4, 1.567e-4), (0.987e-4, -1.654e-4))


def finest(extent: np.ndarray, spacing: float = _FINEST) -> float:
    """Return the spacing, m, of the finest grid that a body of extent (3,) m fits in, at least the one given."""
    while np.prod(_shape(extent, spacing)) > MAX_NODES:
        spacing *= _STEP_UP
    return float(np.round(spacing, 8))


def _shape(extent: np.ndarray, spacing: float) -> tuple[int, ...]:
    """Nodes along x, y and z of the grid of a body of extent (3,) m while its spline is fitted."""
    return tuple(int(n) + 3 + 2 * _SPARE for n in np.ceil((extent + 2 * MARGIN) / spacing))


def build(mesh: Any, where: str | os.PathLike, spacing: float) -> SplineGrid | TipGrid:
    """Build the grid of a solid mesh's signed distance (a trimesh, mm).

    where : names the mesh in messages; spacing : m. Where the whole body takes more than MAX_NODES nodes, it is that of
        its lowest REACH, which may touch; the rest has a coarser one.
    Raises TactileError where that takes too many, too, and for a mesh that overlaps itself.
    """
    extent = np.ptp(mesh.bounds, axis=0) * 1e-3
    if np.prod(_shape(extent, spacing)) <= MAX_NODES:
        return _grid(mesh, where, spacing, extent)
    tip = np.minimum(extent, [np.inf, np.inf, REACH + BAND])
    _check_memory(where, _shape(tip, spacing), spacing)
    coarse = _grid(mesh, where, finest(extent, _STEM * spacing), extent)
    return TipGrid(_grid(mesh, where, spacing, tip), coarse, mesh.bounds[0, 2] * 1e-3 + REACH)


def _grid(mesh: Any, where: str | os.PathLike, spacing: float, extent: np.ndarray) -> SplineGrid:
    """Build the grid of what lies in the extent (3,) m above the mesh's lower bounds."""
    import scipy.ndimage

    shape = _shape(extent, spacing)
    # The outermost node that is kept lies outside of the known box.
    origin = mesh.bounds[0] * 1e-3 - MARGIN - spacing * (1 + _SPARE)
    distance = _signed(mesh, where, origin * 1e3, spacing * 1e3, shape) * 1e-3
    coefficients = scipy.ndimage.spline_filter(distance, order=3, output=np.float64, mode="mirror")
    kept = np.ascontiguousarray(coefficients[(slice(_SPARE, -_SPARE),) * 3], np.float32)
    return SplineGrid(origin + spacing * _SPARE, spacing, kept)


def _check_memory(where: str | os.PathLike, shape: tuple[int, ...], spacing: float) -> None:
    excess = np.prod(shape) / MAX_NODES
    if excess > 1:
        least = np.ceil(spacing * excess ** (1 / 3) * 1e5 + 1) / 1e2  # mm, and a little more
        found = f"a grid of {np.prod(shape) / 1e6:.0f} million nodes with spacing_mm = {spacing * 1e3:g}"
        expected = f"at most {MAX_NODES // 10**6} million (32 MB)"
        raise TactileError(where, found, expected, f"Give it spacing_mm = {least:g}, or a narrower part")


def _signed(
    mesh: Any, where: str | os.PathLike, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> np.ndarray:
    """Signed distance (shape) mm at the nodes of a grid, mm."""
    try:
        within = inside(mesh.triangles, origin, spacing, shape)
    except OverlapError:
        found, expected = "parts of it overlap", "a surface that does not cross itself"
        raise TactileError(where, found, expected, "Unite its parts (boolean union)") from None
    return signed(mesh.triangles, origin, spacing, within)


def error_of(
    mesh: Any, distance: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], top: float = np.inf
) -> np.ndarray:
    """Return the RMS and largest error (2,) m of an indenter's ``distance`` against its mesh (mm) near the surface.

    Measured at random places over its area, of triangles that reach below the height ``top``, m, up to 0.3 mm inside
    and outside. The signs are checked by counting how often a ray from there meets the mesh.
    """
    import trimesh

    random = np.random.default_rng(0)
    area = np.where(mesh.triangles[:, :, 2].min(axis=1) < top * 1e3, mesh.area_faces, 0)
    face = random.choice(len(mesh.faces), _CHECKED, p=area / area.sum())
    weights = random.dirichlet([1, 1, 1], _CHECKED)
    points = np.einsum("nk,nkd->nd", weights, mesh.triangles[face])
    points += mesh.face_normals[face] * random.uniform(-_CHECKED_WITHIN_MM, _CHECKED_WITHIN_MM, (_CHECKED, 1))
    exact = trimesh.proximity.closest_point(mesh, points)[1]
    error = distance(points * 1e-3)[0] - np.where(mesh.contains(points), -exact, exact) * 1e-3
    return np.array([np.sqrt(np.mean(error**2)), np.abs(error).max()])


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


class OverlapError(Exception):
    """Error for a mesh that overlaps itself: a column enters it twice before it leaves."""


def inside(triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, ...]) -> np.ndarray:
    """Mark (shape) bool the nodes at ``origin`` + spacing * (i, j, k) inside the mesh of triangles (m, 3, 3), one unit.

    Along each column the crossings must alternate between entering and leaving. Raises OverlapError where they do not;
    where a column grazes an edge, others beside it are tried first.
    """
    for beside in _BESIDE:
        column, height, entering = _crossings(triangles, origin + spacing * np.array([*beside, 0]), spacing, shape)
        order = np.lexsort((height, column))
        column, height, step = column[order], height[order], np.where(entering[order], 1, -1)
        layers = np.cumsum(step)
        if np.isin(layers, (0, 1)).all() and (layers[np.flatnonzero(np.diff(column, append=-1))] == 0).all():
            first_node = np.clip(np.ceil((height - origin[2]) / spacing), 0, shape[2]).astype(int)
            change = np.zeros((shape[0] * shape[1], shape[2] + 1), np.int32)
            np.add.at(change, (column, first_node), step)
            return (np.cumsum(change, axis=1)[:, :-1] > 0).reshape(shape)
    raise OverlapError


def _crossings(
    triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of columns and triangles: column (k,) int, height (k,), true (k,) where going up enters the body."""
    flat = (triangles[:, :, :2] - origin[:2]) / spacing
    low = np.clip(np.ceil(flat.min(axis=1)), 0, None).astype(int)
    high = np.minimum(np.floor(flat.max(axis=1)).astype(int), np.array(shape[:2]) - 1)
    size = np.maximum(high - low + 1, 0)
    count = size[:, 0] * size[:, 1]
    triangle = np.repeat(np.arange(len(triangles)), count)
    k = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    place = low[triangle] + np.column_stack([k // size[triangle, 1], k % size[triangle, 1]])
    arm = flat[triangle] - place[:, None]
    weights = np.stack([_cross(arm[:, (i + 1) % 3], arm[:, (i + 2) % 3]) for i in range(3)], axis=1)
    met = (weights > 0).all(axis=1) | (weights < 0).all(axis=1)
    weights, triangle, place = weights[met], triangle[met], place[met]
    height = np.einsum("nk,nk->n", weights, triangles[triangle, :, 2]) / weights.sum(axis=1)
    return place[:, 0] * shape[1] + place[:, 1], height, weights.sum(axis=1) < 0


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
