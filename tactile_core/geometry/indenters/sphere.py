"""A ball."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...files.compiled import Loop
from .indenter import NEAREST, Indenter, SceneForm, Size, check_length, contiguous


@dataclasses.dataclass(frozen=True)
class Sphere(Indenter):
    """A ball of the given radius, m."""

    radius: float

    def __post_init__(self) -> None:
        check_length("sphere", "radius", self.radius)

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the exact distance (n,) m and its gradient (n, 3); see ``Indenter.distance``."""
        length, normal = _polar(contiguous(points), self.radius, NEAREST)
        return length - self.radius, normal

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's second derivatives (n, 3, 3) 1/m; see ``Indenter.curvature``."""
        length, normal = _polar(contiguous(points), self.radius, NEAREST)
        return (np.eye(3) - normal[:, :, None] * normal[:, None, :]) / length[:, None, None]

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the body's farthest point (3,) m along a direction (3,); see ``Indenter.support``."""
        return np.array([0.0, 0.0, self.radius]) + self.radius * direction


@Loop
def _polar(points, height, nearest):  # noqa: ANN001, ANN202
    """Return the distance (n,) m, at least nearest, and direction (n, 3) of points (n, 3) m from (0, 0, height m)."""
    distance, direction = np.empty(len(points)), np.empty((len(points), 3))
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2] - height
        length = np.sqrt(x * x + y * y + z * z)
        if length < nearest:
            x, y, z, length = 0.0, 0.0, -nearest, nearest
        distance[p] = length
        direction[p, 0], direction[p, 1], direction[p, 2] = x / length, y / length, z / length
    return distance, direction


SCENE = SceneForm("sphere", Sphere, "A ball", {"radius": Size("radius_mm", slider="radius")}, "Sphere", "MESH_UVSPHERE")
