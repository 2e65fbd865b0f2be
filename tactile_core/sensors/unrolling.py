"""Unroll a BioTac's pad onto the gel's plane and back; find a surface's normals, and its nearest places to points."""

from __future__ import annotations

import functools

import numpy as np

from ..geometry.cubic_spline import on_grid
from ..geometry.lattice import Lattice
from .skin_shape import skin_of

_STENCIL = 1e-3 * np.array([[0, 1, -1, 0, 0], [0, 0, 0, 1, -1]])  # of (row, column), for differences


def node_normals(nodes: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit outward normals (n, 3) at nodes (n, 3) m: the area-weighted mean of the triangles round each.
    faces : (f, 3) nodes of each triangle, counter-clockwise from outside"""
    corners = nodes[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 6
    summed = [np.bincount(faces.ravel(), np.repeat(area[:, k], 3), minlength=len(nodes)) for k in range(3)]
    normals = np.stack(summed, -1)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return normals / np.where(length > 0, length, 1)


@functools.cache
def rolled_x(sensor: str) -> np.ndarray:
    """Return the unrolled x (stations,) m of a skin's stations: ``origin_x`` plus the arc length from there to the
    station along the lowest line, negative toward the tip."""
    skin = skin_of(sensor)
    origin = skin.descriptor.unrolling.origin_x
    line = skin.skin_grid("outer")[:, np.argmin(np.abs(skin.angles))]
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]
    return origin + length - np.interp(origin, line[:, 0], length)


def rolled_grid(sensor: str) -> np.ndarray:
    """Return unrolled places (rows, columns, 2) = (x, z) m of the skin's grid of nodes, its back included."""
    skin = skin_of(sensor)
    across = skin.descriptor.unrolling.radius * skin.angles
    return np.stack(np.broadcast_arrays(rolled_x(sensor)[1:-1, None], across), -1)


def unrolled_nodes(sensor: str = "biotac") -> np.ndarray:
    """Return places (n_nodes, 2) = (x, z) m of a fluid sensor's nodes, unrolled onto the DIGIT's plane: z = R theta
    across the finger, x by arc length of the lowest line (docs/sources.md). NaN on the back, beyond 90 degrees, and at
    the poles."""
    skin = skin_of(sensor)
    on_pad = np.abs(skin.angles)[None, :, None] <= skin.pad_angle + 1e-9
    rolled = np.where(on_pad, rolled_grid(sensor), np.nan)
    return np.concatenate([rolled.reshape(-1, 2), np.full((2, 2), np.nan)])


@functools.cache
def _skin_axes(sensor: str) -> np.ndarray:
    """Return the coordinates x, y, z (3, stations, columns) m of the outer skin's stations."""
    return np.ascontiguousarray(np.moveaxis(skin_of(sensor).skin_grid("outer"), 2, 0))


def roll_up(point: np.ndarray, sensor: str = "biotac") -> tuple[np.ndarray, np.ndarray]:
    """Return the place (3,) m on a fluid sensor's resting skin that unrolls onto point (2,) = (x, z) m, and its outward
    unit normal (3,). The point is clamped to the skin: x between the poles, z within the columns' angles."""
    skin = skin_of(sensor)
    stations, angles, radius = rolled_x(sensor), skin.angles, skin.descriptor.unrolling.radius
    row = np.interp(point[0], stations, np.arange(len(stations)))
    column = np.interp(point[1] / radius, angles, np.arange(len(angles)))
    places = np.array([[row], [column]]) + _STENCIL
    position, above, below, right, left = on_grid(_skin_axes(sensor), places, closed=True)
    normal = np.cross(above - below, right - left)
    return position, normal / np.linalg.norm(normal)


def closest_on_triangles(surface: Lattice, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the place on a surface nearest to each of points (n, 3) m: face (n,) by index, barycentric weights (n, 3),
    place (n, 3) m. Ericson, Real-Time Collision Detection, 5.1.5, by projection onto plane and edges."""
    faces, weights, places = [], [], []
    a, b, c = np.moveaxis(surface.rest[surface.faces], 1, 0)
    for point in points:
        w = _closest_weights(point, a, b, c)
        at = np.einsum("fk,fkd->fd", w, np.stack([a, b, c], 1))
        best = int(np.argmin(((at - point) ** 2).sum(1)))
        faces.append(best)
        weights.append(w[best])
        places.append(at[best])
    return np.array(faces), np.array(weights), np.array(places)


def _closest_weights(point: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return barycentric weights (f, 3) of the place on each triangle a, b, c (f, 3) nearest to point (3,): its
    projection onto the plane if that lies inside, else the nearest place on an edge."""
    ab, ac, ap = b - a, c - a, point - a
    d = np.einsum
    g11, g12, g22 = d("fd,fd->f", ab, ab), d("fd,fd->f", ab, ac), d("fd,fd->f", ac, ac)
    r1, r2 = d("fd,fd->f", ab, ap), d("fd,fd->f", ac, ap)
    det = g11 * g22 - g12**2
    v, w = (g22 * r1 - g12 * r2) / det, (g11 * r2 - g12 * r1) / det
    inside = (v >= 0) & (w >= 0) & (v + w <= 1)
    corners = np.stack([a, b, c])
    choices = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        edge = corners[j] - corners[i]
        t = np.clip(d("fd,fd->f", point - corners[i], edge) / d("fd,fd->f", edge, edge), 0, 1)
        weight = np.zeros((len(a), 3))
        weight[:, i], weight[:, j] = 1 - t, t
        gap = ((corners[i] + t[:, None] * edge - point) ** 2).sum(1)
        choices.append((gap, weight))
    gaps = np.stack([gap for gap, _ in choices])
    on_edge = np.stack([weight for _, weight in choices])[np.argmin(gaps, 0), np.arange(len(a))]
    return np.where(inside[:, None], np.stack([1 - v - w, v, w], -1), on_edge)
