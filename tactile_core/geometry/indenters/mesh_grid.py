"""Build the smooth grid of a mesh's signed distance, and measure an indenter's error against its mesh."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from ...errors import TactileError
from ..cubic_spline import EvenSpline
from .mesh_distance import NearTriangles
from .spline_grid import BAND, SplineGrid, TipGrid

MARGIN = 1e-3  # m, how far the grid reaches beyond the body
MAX_NODES = 8_000_000  # 32 MB kept, 200 to 650 MB more while it is built
_STEP_UP = 1.1  # step in the search of a spacing
REACH = 5e-3  # m above the lowest point: deeper than any dent of a gel or skin (assumed)
_STEM = 4  # times the spacing, at least, beyond what may touch
_SPARE = 6  # extra nodes on each side for the fit of the spline: the effect of its ends fades by 0.27 per node
_FINEST = 0.1e-3  # m, finer than either sensor's spacing of nodes
_CHECKED = 500  # points near the surface at which the error is measured
_CHECKED_WITHIN_MM = 0.3  # how near
_ROUNDING_MM = 1e-9
_CELL = 2.5  # spacings, of cells in which triangles are looked up
# Spacings from the surface up to which distances are exact. In the spline, errors beyond fade by 0.27 per node: to
# 0.5 % at the surface. Not a whole number, since flat faces lie whole spacings from nodes and rounding would decide.
_NEAR = 4.1
_FAR = 12  # spacings (assumed)
_ROWS = 500_000  # pairs of a column and a triangle looked at together: about 200 MB
_GRAZES = 1e-6  # spacings, tolerance for rounding within which a column is tested against a triangle
_COARSER = 4  # times the spacing, of the grid that is interpolated beyond
_FEWEST = 5  # nodes that a cubic spline takes
# Columns stand this part of the spacing beside the nodes, so that none meets an edge or a vertex; tried in turn.
_BESIDE = ((1.234e-4, 0.876e-4), (-0.543e-4, 1.567e-4), (0.987e-4, -1.654e-4))


def finest(extent: np.ndarray, spacing: float = _FINEST) -> float:
    """Return ``spacing``, m, raised until the grid of a body of extent (3,) m has at most MAX_NODES nodes."""
    while np.prod(_shape(extent, spacing)) > MAX_NODES:
        spacing *= _STEP_UP
    return float(np.round(spacing, 8))


def _shape(extent: np.ndarray, spacing: float) -> tuple[int, ...]:
    """Return how many nodes, spacing m apart, lie along x, y, z of a body of extent (3,) m, with those for the spline's
    fit."""
    return tuple(int(n) + 3 + 2 * _SPARE for n in np.ceil((extent + 2 * MARGIN) / spacing))


def build(mesh: Any, where: str | os.PathLike, spacing: float) -> tuple[SplineGrid | TipGrid, NearTriangles]:
    """Build the grid, in m, of the signed distance of a solid ``mesh`` (a trimesh, mm); return it and the search index
    used.

    where : names the mesh in messages; spacing : m, between nodes; if they would be more than MAX_NODES, this is the
        spacing in the body's lowest 5 mm (``REACH``), which may touch, and above it is coarser
    Raises TactileError if the lowest part alone has too many nodes, and for a mesh that overlaps itself."""
    extent, near = np.ptp(mesh.bounds, axis=0) * 1e-3, NearTriangles(mesh.triangles, _CELL * spacing * 1e3)
    if np.prod(_shape(extent, spacing)) <= MAX_NODES:
        return _grid(mesh, near, where, spacing, extent), near
    tip = np.minimum(extent, [np.inf, np.inf, REACH + BAND])
    _check_memory(where, _shape(tip, spacing), spacing)
    wide = finest(extent, _STEM * spacing)
    coarse = _grid(mesh, NearTriangles(mesh.triangles, _CELL * wide * 1e3), where, wide, extent)
    return TipGrid(_grid(mesh, near, where, spacing, tip), coarse, mesh.bounds[0, 2] * 1e-3 + REACH), near


def _grid(mesh: Any, near: NearTriangles, where: str | os.PathLike, spacing: float, extent: np.ndarray) -> SplineGrid:
    """Build the grid, spacing m, of the part of a mesh within extent (3,) m from its lower bounds.
    near : search index of its triangles; where : its file"""
    import scipy.ndimage

    shape = _shape(extent, spacing)
    # The outermost node that is kept lies outside of the known box.
    origin = mesh.bounds[0] * 1e-3 - MARGIN - spacing * (1 + _SPARE)
    within = inside(mesh.triangles, origin * 1e3, spacing * 1e3, shape, where)
    distance = signed(near, origin * 1e3, spacing * 1e3, within) * 1e-3
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


def error_of(
    mesh: Any,
    near: NearTriangles,
    distance: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    top: float = np.inf,
) -> np.ndarray:
    """Return the RMS and largest error (2,) m of an indenter's ``distance`` against its mesh (a trimesh, mm).

    near : search index of its triangles; top : m, height below which triangles count, at least in part
    The error is measured at 500 random places within 0.3 mm of the surface."""
    random = np.random.default_rng(0)
    area = np.where(mesh.triangles[:, :, 2].min(axis=1) < top * 1e3, mesh.area_faces, 0)
    face = random.choice(len(mesh.faces), _CHECKED, p=area / area.sum())
    weights = random.dirichlet([1, 1, 1], _CHECKED)
    points = np.einsum("nk,nkd->nd", weights, mesh.triangles[face])
    exact = random.uniform(-_CHECKED_WITHIN_MM, _CHECKED_WITHIN_MM, _CHECKED)
    points += mesh.face_normals[face] * exact[:, None]
    gap = near.distance(points, 2 * _CHECKED_WITHIN_MM)
    low, high = mesh.triangles[:, :, :2].min(axis=1), mesh.triangles[:, :, :2].max(axis=1)
    for i in np.flatnonzero(gap < np.abs(exact) - _ROUNDING_MM):  # another face is nearer: its side is not known
        over = ((low <= points[i, :2]) & (high >= points[i, :2])).all(axis=1)
        _, height, entering = _crossings(mesh.triangles[over], points[i], 1.0, (1, 1))
        inside_of = np.where(entering, 1, -1)[height < points[i, 2]].sum()  # bodies: entered below it, and not left
        exact[i] = gap[i] * (-1 if inside_of > 0 else 1)
    error = distance(points * 1e-3)[0] - exact * 1e-3
    return np.array([np.sqrt(np.mean(error**2)), np.abs(error).max()])


def signed(near: NearTriangles, origin: np.ndarray, spacing: float, within: np.ndarray) -> np.ndarray:
    """Return the distance (shape) mm, negative inside, from nodes ``origin`` + spacing * (i, j, k), mm, to triangles.
    within : bool (shape), true for nodes inside
    It is exact up to _NEAR spacings from the surface; farther off it is interpolated from a grid four times coarser by
    a cubic spline. What this costs in accuracy is measured when an indenter is made (``error_of``)."""
    bound = _NEAR * spacing
    coarse = _coarse(near, origin, spacing, within)
    along = (EvenSpline(0, _COARSER, n).matrix(np.arange(m)) for n, m in zip(coarse.shape, within.shape, strict=True))
    distance = coarse
    for matrix in along:  # each takes the first axis, and leaves it behind the others
        distance = np.tensordot(distance, matrix, axes=(0, 1))
    close = np.flatnonzero((np.abs(distance) < bound) | ((distance < 0) != within))
    exact = near.distance(origin + spacing * _nodes(close, within.shape), bound)
    exact *= np.where(within.ravel()[close], -1, 1)
    known = np.isfinite(exact)
    distance.ravel()[close[known]] = exact[known]
    return distance


def _coarse(near: NearTriangles, origin: np.ndarray, spacing: float, within: np.ndarray) -> np.ndarray:
    """Return the signed distance, mm, at every fourth node of a grid from ``origin`` (3,), ``spacing`` mm, and one
    beyond its end.
    within : bool (shape of the grid), true for nodes inside
    Near the surface it is exact. Up to ``_FAR`` spacings it is the distance to the middle of the nearest piece; farther
    off, to the piece of the nearest such node: a search is slow if many pieces are equally near (a ball's middle)."""
    import scipy.ndimage
    import scipy.spatial

    shape = tuple(max((n + _COARSER - 2) // _COARSER + 1, _FEWEST) for n in within.shape)
    points = origin + _COARSER * spacing * _nodes(np.arange(np.prod(shape)), shape)
    tree = scipy.spatial.cKDTree(near.middles, compact_nodes=False, balanced_tree=False)  # a third of the time
    piece = tree.query(points, distance_upper_bound=_FAR * spacing)[1].reshape(shape)
    known = piece < len(near.middles)
    of = scipy.ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    distance = np.linalg.norm(points - near.middles[piece[tuple(of)].ravel()], axis=1)
    exact = near.distance(points, _NEAR * spacing)
    distance = np.where(np.isfinite(exact), exact, distance).reshape(shape)
    kept = within[::_COARSER, ::_COARSER, ::_COARSER]
    distance[tuple(slice(n) for n in kept.shape)] *= np.where(kept, -1, 1)  # nodes beyond the grid are outside
    return distance


def _nodes(flat: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    return np.stack(np.unravel_index(flat, shape), axis=-1)


def inside(
    triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, ...], where: str | os.PathLike
) -> np.ndarray:
    """Mark (shape) bool which nodes at ``origin`` + spacing * (i, j, k) lie inside the mesh of triangles (m, 3, 3), all
    in mm. shape : numbers of nodes along x, y, z; where : names the mesh in the message
    Along each column the crossings must alternate between entering and leaving. If they do not, as where a column
    grazes an edge, columns beside it are tried; then raises TactileError: the mesh overlaps itself."""
    for beside in _BESIDE:
        column, height, entering = _crossings(triangles, origin + spacing * np.array([*beside, 0]), spacing, shape)
        order = np.lexsort((height, column))
        column, height, step = column[order], height[order], np.where(entering[order], 1, -1)
        layers = np.cumsum(step)
        last = np.diff(column, append=-1) != 0
        wrong = (layers < 0) | (layers > 1) | (last & (layers != 0))
        if not wrong.any():
            first_node = np.clip(np.ceil((height - origin[2]) / spacing), 0, shape[2]).astype(int)
            change = np.zeros((shape[0] * shape[1], shape[2] + 1), np.int8)
            np.add.at(change, (column, first_node), step)
            return (np.cumsum(change, axis=1, dtype=np.int8)[:, :-1] > 0).reshape(shape)
    first = int(np.flatnonzero(wrong)[0])
    across = np.array(divmod(column[first], shape[1]))
    place = ", ".join(f"{x:.3g}" for x in (*(origin[:2] + spacing * across), height[first]))
    found = f"it crosses itself, or parts of it overlap, near ({place}) mm, scaled and turned"
    raise TactileError(where, found, "a surface that does not cross itself", "Unite its parts (boolean union)")


def _crossings(
    triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where columns of nodes, at ``origin`` + spacing * (i, j), cross triangles (m, 3, 3): the column's number
    (k,) int, i * shape[1] + j; the height (k,); true (k,) if going up enters the body there."""
    flat = (triangles[:, :, :2] - origin[:2]) / spacing
    low = np.clip(np.ceil(flat[:, :, 0].min(axis=1)), 0, None).astype(int)
    rows = np.maximum(np.minimum(np.floor(flat[:, :, 0].max(axis=1)).astype(int), shape[0] - 1) - low + 1, 0)
    if rows.sum() > _ROWS and len(triangles) > 1:
        halves = [_crossings(half, origin, spacing, shape) for half in np.array_split(triangles, 2)]
        column, height, entering = (np.concatenate(each) for each in zip(*halves, strict=True))
        return column, height, entering
    triangle, along = _counted(rows)
    along += low[triangle]
    start, step = flat[triangle], np.roll(flat, -1, axis=1)[triangle] - flat[triangle]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (along[:, None] - start[:, :, 0]) / step[:, :, 0]
        across = start[:, :, 1] + share * step[:, :, 1]
    met = (share >= 0) & (share <= 1)
    low = np.clip(np.ceil(np.where(met, across, np.inf).min(axis=1) - _GRAZES), 0, shape[1]).astype(int)
    high = np.clip(np.floor(np.where(met, across, -np.inf).max(axis=1) + _GRAZES), -1, shape[1] - 1).astype(int)
    row, column = _counted(np.maximum(high - low + 1, 0))
    triangle, place = triangle[row], np.column_stack([along[row], low[row] + column])
    arm = flat[triangle] - place[:, None]
    weights = np.stack([_cross(arm[:, (i + 1) % 3], arm[:, (i + 2) % 3]) for i in range(3)], axis=1)
    met = (weights > 0).all(axis=1) | (weights < 0).all(axis=1)
    weights, triangle, place = weights[met], triangle[met], place[met]
    height = np.einsum("nk,nk->n", weights, triangles[triangle, :, 2]) / weights.sum(axis=1)
    return place[:, 0] * shape[1] + place[:, 1], height, weights.sum(axis=1) < 0


def _counted(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Repeat each index of counts (k,) as often as its count; return the indices (n,), and the number (n,) of each
    repetition."""
    index = np.repeat(np.arange(len(counts)), counts)
    return index, np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts, counts)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
