"""A ball."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...files.compiled import available
from .distance_loops import from_ball
from .indenter import NEAREST, Indenter, check_length, contiguous, lengths
from .scene_form import SceneForm, Size


@dataclasses.dataclass(frozen=True)
class Sphere(Indenter):
    """A ball of the given radius, m."""

    radius: float

    def __post_init__(self) -> None:
        check_length("sphere", "radius", self.radius)

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact."""
        if available():
            return from_ball(contiguous(points), self.radius, NEAREST)
        length, normal = self._polar(points)
        return length - self.radius, normal

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter.curvature``."""
        length, normal = self._polar(points)
        return (np.eye(3) - normal[:, :, None] * normal[:, None, :]) / length[:, None, None]

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        return np.array([0.0, 0.0, self.radius]) + self.radius * direction

    def _polar(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance (n,) m from the centre, and the direction away from it (n, 3)."""
        arm = points.copy()
        arm[:, 2] -= self.radius
        length = lengths(arm)
        if length.min(initial=np.inf) < NEAREST:
            arm[length < NEAREST] = [0.0, 0.0, -NEAREST]
            length = np.maximum(length, NEAREST)
        return length, arm / length[:, None]


SCENE = SceneForm("sphere", Sphere, "A ball", {"radius": Size("radius_mm", slider="radius")}, "Sphere", "MESH_UVSPHERE")
