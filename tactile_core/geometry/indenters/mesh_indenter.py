"""Indenter of any closed triangle mesh, through a smooth grid of its signed distance."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import logging
import os
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np

from ...errors import TactileError, path_text
from ...files import array_cache
from ...files.array_cache import cache_folder
from ...files.installed import needing
from ...files.short_text import Summary
from . import mesh_file, mesh_grid
from .indenter import Indenter, lengths
from .spline_grid import SplineGrid, TipGrid

log = logging.getLogger(__name__)
_FORMAT = 5  # raise when the meaning of the cached arrays changes
_ROOM = "40 MB"
_ARRAYS = ("coefficients", "origin", "hull", "error", "stem", "stem_place")  # the last two are empty for one grid
_SPACING = (0.01e-3, 1e-3)  # m
_FLATTEST = 0.5  # least slope that a curvature is divided by: the spline is flatter only deep inside, between faces
_LEVEL = 1e-7  # m, hull vertices this near to the farthest one lie equally far


def as_indenter(body: Any) -> Indenter:
    """Return ``body`` if it is an indenter, or make one of it if it is a ``trimesh.Trimesh`` in metres.

    Raises what ``MeshIndenter.from_trimesh`` does; TactileError for any other object."""
    presses = hasattr(body, "curvature") and not isinstance(body, type)
    return body if presses else MeshIndenter.from_trimesh(body)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MeshIndenter(Summary, Indenter):
    """A rigid body bounded by a triangle mesh.

    Its surface is where a tricubic spline of the mesh's signed distance is zero: smooth, with sharp edges rounded over
    about one grid spacing. Normals and curvatures are exactly those of the spline's level surfaces.

    grid : the spline, m, fine where the body may touch; hull : (k, 3) m, vertices of the mesh's convex hull
    error : rms and largest difference, m, between ``distance`` and the mesh's, at 500 random places within 0.3 mm of it
    """

    grid: SplineGrid | TipGrid
    hull: np.ndarray
    error: tuple[float, float]

    @classmethod
    @needing("fem")
    def from_file(
        cls, path: str | os.PathLike, scale: float = 1e-3, up: str = "z", spacing: float = 0.1e-3
    ) -> MeshIndenter:
        """Load the body in an STL, PLY, OBJ or OFF file; its grid is built once and cached on disk.

        Building takes .3 to 5 s of CPU time, minutes for 100,000 slender triangles or without numba.

        scale : m per unit of the file; up : the file's axis ("x" ... "-z") that points out of the sensor
        spacing : m, 1e-5 to 1e-3, of the grid; if that has over 8 million nodes, of its lowest 5 mm, and coarser above
        The body's lowest point, or the middle of its lowest flat, becomes the own origin.
        Raises TactileError for anything that is no closed, outward surface of an indenter's size, for one that crosses
        itself by more than the grid's spacing (less is not seen), for arguments out of range, and for files that cannot
        be read or are too large; ModuleNotFoundError without extra [fem].
        """
        _check(path, scale, up, spacing)
        content = mesh_file.read_bytes(path)
        settings = json.dumps([_FORMAT, pathlib.Path(path).suffix.lower(), scale, up, spacing]).encode()
        digest = hashlib.sha256(settings + content).hexdigest()
        return cls._cached(digest, lambda: mesh_file.solid(content, path, scale, up), path, spacing)

    @classmethod
    @needing("fem")
    def from_trimesh(cls, mesh: Any, spacing: float | None = None) -> MeshIndenter:
        """Take a ``trimesh.Trimesh``, metres, in its own frame; its grid is built once and cached on disk by its hash.

        spacing : m, of the grid, over which sharp edges are rounded; None for 0.1 mm, or more if the body is large
        Raises TactileError as ``from_file`` does, and for more than 200,000 triangles.
        """
        try:
            vertices, faces = np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
        except (AttributeError, TypeError, ValueError):
            found = f"a {type(mesh).__name__}"
            raise TactileError(
                "indenter", found, "an indenter of tactile_core, or a trimesh.Trimesh in metres"
            ) from None
        mesh_file.check_triangles("indenter", vertices, faces)
        mesh_file.check_size("indenter", np.ptp(vertices, axis=0).max(), 1.0)
        spacing = mesh_grid.finest(np.ptp(vertices, axis=0)) if spacing is None else spacing
        _check("indenter", 1.0, "z", spacing)
        digest = hashlib.sha256(json.dumps([_FORMAT, "trimesh", spacing, vertices.shape]).encode())
        digest.update(np.ascontiguousarray(vertices).tobytes() + np.ascontiguousarray(faces).tobytes())
        make = functools.partial(mesh_file.closed_mesh, vertices, faces, "indenter", 1.0)
        return cls._cached(digest.hexdigest(), make, "indenter", spacing)

    @classmethod
    def _cached(cls, digest: str, make: Callable[[], Any], where: str | os.PathLike, spacing: float) -> MeshIndenter:
        """Return the indenter of a mesh: its grid from the cache, or built of the mesh (mm) that ``make`` returns.
        digest : of the mesh, names the cache's folder; where : the mesh's file, for errors; spacing : m, of the grid"""
        folder = cache_folder() / f"indenter-{digest[:16]}"
        try:
            arrays = _load(folder)
        except array_cache.DamagedError as damage:
            if (folder / array_cache.HASHES).exists():
                log.warning("%s: damaged (%s); it is built again", folder, damage)
            log.info("building the distance grid of %s in %s (once)", where, folder)
            mesh = make()
            grid, near = mesh_grid.build(mesh, where, spacing)
            built = cls(grid, _hull(mesh), (0.0, 0.0))
            error = mesh_grid.error_of(mesh, near, built.distance, getattr(grid, "top", np.inf))
            log.info("%s: distance within %.1f um rms, %.1f um at most", where, *(error * 1e6))
            array_cache.claim(folder, _ROOM)
            array_cache.store(folder, _arrays_of(built, error).items(), _ROOM)
            arrays = _load(folder)
        coefficients, origin, hull, error, stem, stem_place = arrays
        fine, rms_and_largest = SplineGrid(origin, spacing, coefficients), (float(error[0]), float(error[1]))
        if not len(stem):
            return cls(fine, hull, rms_and_largest)
        coarse = SplineGrid(stem_place[:3], float(stem_place[3]), stem)
        return cls(TipGrid(fine, coarse, float(stem_place[4])), hull, rms_and_largest)

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the spline's value (n,) m and its level surface's unit normal (n, 3); see ``Indenter.distance``.

        Across a sharp edge the spline is flatter than a distance, down to a slope of 0.7.
        """
        value, slope = self.grid.value_and_gradient(points)
        return value, _unit(slope)[1]

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the unit normal's derivative (n, 3, 3) 1/m along the level surface; see ``Indenter.curvature``."""
        slope, bend = self.grid.gradient_and_hessian(points)
        steepness, normal = _unit(slope)
        along = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        return along @ bend @ along / np.maximum(steepness, _FLATTEST)[:, None, None]

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the mesh's own farthest point (3,) m along a direction (3,); see ``Indenter.support``."""
        reach = self.hull @ direction
        return self.hull[reach > reach.max() - _LEVEL].mean(axis=0)


def _arrays_of(built: MeshIndenter, error: np.ndarray) -> dict[str, np.ndarray]:
    """Return the arrays that the cache keeps, by name. error : rms and largest, m. ``stem`` is the coarse grid, empty
    for none, ``stem_place`` its origin, spacing and top."""
    grid, stem, place = built.grid, np.zeros((0, 0, 0), np.float32), np.zeros(0)
    fine = grid.fine if isinstance(grid, TipGrid) else grid
    if isinstance(grid, TipGrid):
        coarse = grid.coarse
        stem, place = coarse.coefficients, np.array([*coarse.origin, coarse.spacing, grid.top])
    return dict(zip(_ARRAYS, (fine.coefficients, fine.origin, built.hull, error, stem, place), strict=True))


def _unit(slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the length (n,) of each slope (n, 3), and unit normals (n, 3) along them; (0, 0, -1) for a zero slope."""
    length = lengths(slope)
    if length.min(initial=1) < 1e-6:
        flat = length < 1e-6
        slope, length = np.where(flat[:, None], [0.0, 0.0, -1.0], slope), np.where(flat, 1.0, length)
    return length, slope / length[:, None]


def _check(path: str | os.PathLike, scale: float, up: str, spacing: float) -> None:
    path_text(path, "MeshIndenter.from_file, path")
    if not (np.isfinite(scale) and scale > 0):
        raise TactileError(path, f"unit_mm = {scale * 1e3:g}", "millimetres per unit of the file, above zero")
    if up not in mesh_file.UPS:
        raise TactileError(path, f"up = {up!r}", f"one of {', '.join(mesh_file.UPS)}")
    if not _SPACING[0] <= spacing <= _SPACING[1]:
        raise TactileError(path, f"spacing_mm = {spacing * 1e3:g}", "0.01 to 1 mm")


def _hull(mesh: Any) -> np.ndarray:
    """Return the vertices (k, 3) m of the convex hull of a mesh in mm."""
    import scipy.spatial

    return mesh.vertices[scipy.spatial.ConvexHull(mesh.vertices).vertices] * 1e-3


@functools.lru_cache(maxsize=4)  # a scene asks for its indenters at every press
def _load(folder: pathlib.Path) -> tuple[np.ndarray, ...]:
    arrays = tuple(array.copy() for array in array_cache.load(folder, _ARRAYS).values())
    for array in arrays:
        array.flags.writeable = False
    return arrays
