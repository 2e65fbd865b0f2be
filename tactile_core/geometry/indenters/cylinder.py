"""An upright cylinder."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...errors import TactileError
from ...files.compiled import available
from . import extrusion
from .distance_loops import from_cylinder
from .indenter import NEAREST, SQUARE, Indenter, check_length, contiguous, sign_of
from .scene_form import SceneForm, Size


@dataclasses.dataclass(frozen=True)
class Cylinder(Indenter):
    """An upright cylinder that touches with its flat end; ``edge`` rounds the rim. Lengths in m."""

    radius: float
    edge: float
    length: float = 10e-3

    def __post_init__(self) -> None:
        for name in ("radius", "edge", "length"):
            check_length("cylinder", name, getattr(self, name))
        if self.edge >= self.radius or 2 * self.edge >= self.length:
            raise TactileError("cylinder, edge", f"{self.edge * 1e3:g} mm", "less than radius and half the length")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact."""
        if available():
            inner, half = self.radius - self.edge, self.length / 2
            return from_cylinder(contiguous(points), 2, self._middle, inner, half - self.edge, self.edge, NEAREST)
        return extrusion.distance(*self._prism(points), self.edge)

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter.curvature``."""
        return extrusion.curvature(*self._prism(points))

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        ring = np.hypot(direction[0], direction[1])
        radial = np.array([direction[0], direction[1], 0.0]) / ring if ring > SQUARE else np.zeros(3)
        upward = np.array([0.0, 0.0, sign_of(direction[2])])
        inner = (self.radius - self.edge) * radial + (self.length / 2 - self.edge) * upward
        return np.array([0.0, 0.0, self.length / 2]) + inner + self.edge * direction

    @functools.cached_property
    def _middle(self) -> np.ndarray:
        return np.array([0.0, 0.0, self.length / 2])

    def _prism(self, points: np.ndarray) -> tuple[extrusion.Outline, np.ndarray, float]:
        outline = extrusion.disc(points[:, :2], self.radius - self.edge)
        return outline, points[:, 2] - self.length / 2, self.length / 2 - self.edge


SCENE = SceneForm(
    "cylinder",
    Cylinder,
    "The flat, rounded end of an upright cylinder",
    {
        "radius": Size("radius_mm", slider="radius"),
        "edge": Size("edge_mm", 0.5, slider="edge"),
        "length": Size("length_mm", 10.0, slider="length"),
    },
    "Cylinder",
    "MESH_CYLINDER",
)
