"""A box."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...errors import TactileError
from ...files.compiled import Loop
from .indenter import NEAREST, Indenter, SceneForm, Size, check_length, contiguous, lengths, sign_of


@dataclasses.dataclass(frozen=True)
class Box(Indenter):
    """A box with edges along its own axes that touches with its flat lower face.

    sizes : full lengths along x, y, z, m; edge : m, radius of its edges and corners, less than half the smallest size
    """

    sizes: tuple[float, float, float]
    edge: float

    def __post_init__(self) -> None:
        if np.shape(self.sizes) != (3,):
            raise TactileError("box, sizes", f"{self.sizes!r:.80}", "three lengths in m, along x, y and z")
        for name, value in zip(("size x", "size y", "size z", "edge"), (*self.sizes, self.edge), strict=True):
            check_length("box", name, value)
        if 2 * self.edge >= min(self.sizes):
            raise TactileError("box, edge", f"{self.edge * 1e3:g} mm", "less than half of the smallest size")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the exact signed distance (n,) m of points (n, 3) m, that of a smaller box less the edge radius, and
        its gradient (n, 3); see ``Indenter.distance``."""
        return _from_box(contiguous(points), self._middle, self._inner, self.edge)

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's second derivatives (n, 3, 3) 1/m at points (n, 3) m: 0 at faces, 1 / arm across round
        edges and along all tangents of round corners."""
        arm = points - self._middle
        out = np.abs(arm) - self._inner
        beyond = np.copysign(np.maximum(out, 0), arm)
        length = np.maximum(lengths(beyond), NEAREST)[:, None, None]
        normal = beyond[:, :, None] / length
        round_axes = np.eye(3) * (out > 0)[:, None, :]
        return np.where((out > 0).sum(1)[:, None, None] > 1, (round_axes - normal * normal.swapaxes(1, 2)) / length, 0)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the body's farthest point (3,) m along a direction (3,); see ``Indenter.support``."""
        return self._middle + self._inner * sign_of(direction) + self.edge * direction

    @functools.cached_property
    def _middle(self) -> np.ndarray:
        return np.array([0.0, 0.0, self.sizes[2] / 2])

    @functools.cached_property
    def _inner(self) -> np.ndarray:
        """Half-sizes (3,) m of the smaller box."""
        return np.array(self.sizes) / 2 - self.edge


@Loop
def _from_box(points, middle, inner, edge):  # noqa: ANN001, ANN202
    """Return the distance (n,) m of points (n, 3) m from a box, and its gradient (n, 3). middle : (3,) m, the centre
    inner : (3,) m, half sides before the box is inflated by ``edge`` m"""
    distance, gradient = np.empty(len(points)), np.empty((len(points), 3))
    for p in range(len(points)):
        square, face, deepest = 0.0, 0, -np.inf
        for i in range(3):
            out = abs(points[p, i] - middle[i]) - inner[i]
            if out > deepest:
                face, deepest = i, out
            beyond = max(out, 0.0)
            gradient[p, i] = beyond
            square += beyond * beyond
        corner = np.sqrt(square)
        distance[p], far = corner - edge, corner
        if corner == 0:
            distance[p] += deepest
            gradient[p, face], far = 1.0, 1.0
        for i in range(3):
            gradient[p, i] = np.copysign(gradient[p, i], points[p, i] - middle[i]) / far
    return distance, gradient


SCENE = SceneForm(
    "box",
    Box,
    "The flat face of a box",
    {"sizes": Size("sizes_mm", slider="length", count=3), "edge": Size("edge_mm", 0.5, slider="edge")},
    "Box",
    "MESH_CUBE",
)
