"""The gel as a triangle mesh for Mitsuba, made from a height map."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import TactileError
from ...geometry.lattice import grid_faces
from ...sensors.camera import Camera
from ..perspective import slopes
from ..presets import SPACING

# m of gel round the picture, as high as the picture's edge (13 x 17 mm of 18.4 x 25: docs/sources.md, DIGIT camera).
MARGIN = 3e-3
# Mitsuba's ray offsets are made for scenes of about unit size; in metres they would be 0.1 mm.
MM = 1e3
MOST_MISSED = 1e-3  # share of rays; measured: 1e-6 slip through


class GelMesh:
    """Vertices and faces of height maps under one camera. Mesh coordinates: right, up and toward the camera, mm.

    For square pixels, up is scaled: lines stay straight, so visibility is right, but lengths and angles are not."""

    def __init__(self, camera: Camera, spacing: float = SPACING, *, square: bool = False) -> None:
        """Take a camera; spacing : m between vertices, in whole pixels; square : true scales up, for square pixels."""
        self.camera = camera
        right, down = camera.pixel_size
        self.up_scale = right / down if square else 1.0
        self._rows = _kept(camera.height, max(1, round(spacing / down)))
        self._columns = _kept(camera.width, max(1, round(spacing / right)))
        across, along = _extended(camera.right[self._columns]), _extended(camera.down[self._rows])
        self._rows, self._columns = (np.r_[kept[0], kept, kept[-1]] for kept in (self._rows, self._columns))
        plan = np.empty((len(along), len(across), 3), np.float32)
        plan[..., 0] = across * MM
        plan[..., 1] = -along[:, None] * (MM * self.up_scale)
        self._plan = plan
        # Rows grow downward, so that (row x column) points to the camera: outward for Mitsuba.
        self.faces = grid_faces(len(along), len(across), closed=False).astype(np.uint32)

    def vertices(self, height: np.ndarray) -> np.ndarray:
        """Return the vertices (n, 3) float32, mesh coordinates, of a gel of ``height`` (H, W) m.
        Raises TactileError for heights that are not finite, on which Mitsuba would crash."""
        if not np.isfinite(height).all():
            raise TactileError("gel mesh, vertices", "values that are not finite", "finite numbers")
        self._plan[..., 2] = height[np.ix_(self._rows, self._columns)] * MM
        return self._plan.reshape(-1, 3).copy()

    def normals(self, height: np.ndarray) -> np.ndarray:
        """Return the vertices' unit normals (n, 3) float32 by the slopes of height (H, W) m; not for a scaled mesh."""
        right, down = (each[np.ix_(self._rows, self._columns)] for each in slopes(height, self.camera))
        found = np.stack([-right, down, np.ones_like(right)], -1)
        found /= np.linalg.norm(found, axis=-1, keepdims=True)
        return found.reshape(-1, 3).astype(np.float32)

    def shape(self, mi: Any, height: np.ndarray, *, smooth: bool = False) -> Any:
        """Return the gel of height (H, W) m as a mesh of Mitsuba's module ``mi``; smooth : true gives it normals."""
        return triangle_mesh(mi, "gel", self.vertices(height), self.faces, smooth=smooth)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and the highest corner (3,) of the mesh at height zero, mesh coordinates."""
        flat = self._plan[..., :2].reshape(-1, 2)
        return np.r_[flat.min(0), 0.0].astype(float), np.r_[flat.max(0), 0.0].astype(float)


def _kept(count: int, step: int) -> np.ndarray:
    """Return the indices of every ``step``-th of ``count`` pixels, and of the last one."""
    kept = np.arange(0, count, step)
    return kept if kept[-1] == count - 1 else np.r_[kept, count - 1]


def _extended(values: np.ndarray) -> np.ndarray:
    return np.r_[values[0] - MARGIN, values, values[-1] + MARGIN]


def triangle_mesh(mi: Any, name: str, vertices: np.ndarray, faces: np.ndarray, *, smooth: bool = False) -> Any:
    """Return a mesh of Mitsuba's, called ``name``, of vertices (n, 3) float32 and faces (m, 3) uint32.
    mi : Mitsuba's module; smooth : true gives its vertices normals"""
    mesh = mi.Mesh(name, len(vertices), len(faces), has_vertex_normals=smooth)
    values = mi.traverse(mesh)
    values["faces"], values["vertex_positions"] = faces.ravel(), vertices.ravel()
    values.update()
    return mesh


def mend(missed: np.ndarray, *maps: np.ndarray) -> None:
    """Fill pixels whose rays missed the gel from a neighbour, in place. missed : (H, W) bool; maps : (H, W, ...). A ray
    in a million slips between two triangles. Raises TactileError if over 0.1 % have missed."""
    if missed.mean() > MOST_MISSED:
        found = f"{missed.sum()} of {missed.size} rays miss it"
        raise TactileError("gel mesh", found, "a gel that fills the picture", "Check heights and camera")
    for row, column in np.argwhere(missed):
        for values in maps:
            values[row, column] = values[row, column - 1 if column else 1]
