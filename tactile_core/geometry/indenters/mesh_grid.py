"""Build the smooth grid of a mesh's signed distance, and measure an indenter's error against its mesh."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from ...errors import TactileError
from . import mesh_distance
from .mesh_inside import OverlapError, inside
from .spline_grid import SplineGrid

MARGIN = 1e-3  # m, how far the grid reaches beyond the body
MAX_NODES = 8_000_000  # 32 MB kept, about 300 MB while it is built
_COARSER = 1.1  # step in the search of a spacing
_SPARE = 6  # nodes more on every side while the spline is fitted: what it assumes at its ends fades by 0.27 a node
_FINEST = 0.1e-3  # m: finer than the nodes of either sensor
_CHECKED = 500  # points near the surface at which the error is measured
_NEAR_MM = 0.3  # how near


def finest(extent: np.ndarray) -> float:
    """Return the spacing, m, of the finest grid that a body of extent (3,) m fits in, 0.1 mm at least."""
    spacing = _FINEST
    while np.prod(np.ceil((extent + 2 * MARGIN) / spacing) + 3 + 2 * _SPARE) > MAX_NODES:
        spacing *= _COARSER
    return float(np.round(spacing, 8))


def build(mesh: Any, where: str | os.PathLike, spacing: float) -> SplineGrid:
    """Build the grid of a solid mesh's signed distance (a trimesh, mm).

    where : names the mesh in messages; spacing : m
    Raises TactileError for a grid of more than MAX_NODES nodes, and for a mesh that overlaps itself.
    """
    import scipy.ndimage

    lower, extent = mesh.bounds[0] * 1e-3 - MARGIN, np.ptp(mesh.bounds, axis=0) * 1e-3 + 2 * MARGIN
    shape = tuple(int(n) + 3 + 2 * _SPARE for n in np.ceil(extent / spacing))
    _check_memory(where, shape, spacing)
    origin = lower - spacing * (1 + _SPARE)  # the outermost node that is kept lies outside of the known box
    distance = _signed(mesh, where, origin * 1e3, spacing * 1e3, shape) * 1e-3
    coefficients = scipy.ndimage.spline_filter(distance, order=3, output=np.float64, mode="mirror")
    kept = np.ascontiguousarray(coefficients[(slice(_SPARE, -_SPARE),) * 3], np.float32)
    return SplineGrid(origin + spacing * _SPARE, spacing, kept)


def _check_memory(where: str | os.PathLike, shape: tuple[int, ...], spacing: float) -> None:
    excess = np.prod(shape) / MAX_NODES
    if excess > 1:
        least = np.ceil(spacing * excess ** (1 / 3) * 1e5 + 1) / 1e2  # mm, and a little more
        found = f"a grid of {np.prod(shape) / 1e6:.0f} million nodes"
        expected = f"at most {MAX_NODES // 10**6} million (32 MB)"
        raise TactileError(where, found, expected, f"Take a spacing of {least:g} mm or a smaller part of the body")


def _signed(
    mesh: Any, where: str | os.PathLike, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> np.ndarray:
    """Signed distance (shape) mm at the nodes of a grid, mm."""
    try:
        within = inside(mesh.triangles, origin, spacing, shape)
    except OverlapError:
        found, expected = "parts of it overlap", "a surface that does not cross itself"
        raise TactileError(where, found, expected, "Unite its parts (boolean union)") from None
    return mesh_distance.signed(mesh.triangles, origin, spacing, within)


def error_of(mesh: Any, distance: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return the RMS and largest error (2,) m of an indenter's ``distance`` against its mesh (mm) near the surface.

    Measured at random places over its area, up to 0.3 mm inside and outside. The signs are checked by counting how
    often a ray from there meets the mesh.
    """
    import trimesh

    random = np.random.default_rng(0)
    face = random.choice(len(mesh.faces), _CHECKED, p=mesh.area_faces / mesh.area_faces.sum())
    weights = random.dirichlet([1, 1, 1], _CHECKED)
    points = np.einsum("nk,nkd->nd", weights, mesh.triangles[face])
    points += mesh.face_normals[face] * random.uniform(-_NEAR_MM, _NEAR_MM, (_CHECKED, 1))
    exact = trimesh.proximity.closest_point(mesh, points)[1]
    error = distance(points * 1e-3)[0] - np.where(mesh.contains(points), -exact, exact) * 1e-3
    return np.array([np.sqrt(np.mean(error**2)), np.abs(error).max()])
