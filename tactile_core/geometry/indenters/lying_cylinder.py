"""A cylinder that lies on its side."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...errors import TactileError
from . import extrusion
from .cylinder import from_cylinder
from .indenter import NEAREST, Indenter, check_length, contiguous, sign_of
from .scene_form import SceneForm, Size

_OWN = np.array([2, 0, 1])  # extrusions answer in the order y, z, x


@dataclasses.dataclass(frozen=True)
class LyingCylinder(Indenter):
    """A cylinder along the own x that touches with its side; ``edge`` rounds both rims. Lengths in m.

    An edge as large as the radius makes the ends half balls.
    """

    radius: float
    edge: float
    length: float = 20e-3

    def __post_init__(self) -> None:
        for name in ("radius", "edge", "length"):
            check_length("lying cylinder", name, getattr(self, name))
        if self.edge > self.radius or 2 * self.edge >= self.length:
            expected = "at most the radius and less than half the length"
            raise TactileError("lying cylinder, edge", f"{self.edge * 1e3:g} mm", expected)

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact."""
        inner, half = self.radius - self.edge, self.length / 2
        return from_cylinder(contiguous(points), 0, self._middle, inner, half - self.edge, self.edge, NEAREST)

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter.curvature``."""
        return extrusion.curvature(*self._prism(points))[:, _OWN][:, :, _OWN]

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        ring = np.hypot(direction[1], direction[2])
        radial = np.array([0.0, *direction[1:]]) / max(ring, 1e-300) * abs(sign_of(ring))
        inner = (self.radius - self.edge) * radial
        inner[0] = (self.length / 2 - self.edge) * sign_of(direction[0])
        return np.array([0.0, 0.0, self.radius]) + inner + self.edge * direction

    @functools.cached_property
    def _middle(self) -> np.ndarray:
        return np.array([0.0, 0.0, self.radius])

    def _prism(self, points: np.ndarray) -> tuple[extrusion.Outline, np.ndarray, float]:
        across = points[:, 1:].copy()
        across[:, 1] -= self.radius
        outline = extrusion.disc(across, self.radius - self.edge)
        return outline, points[:, 0], self.length / 2 - self.edge


SCENE = SceneForm(
    "lying_cylinder",
    LyingCylinder,
    "The side of a cylinder along the finger",
    {
        "radius": Size("radius_mm", slider="radius"),
        "edge": Size("edge_mm", 0.5, slider="edge"),
        "length": Size("length_mm", 20.0, slider="length"),
    },
    "Lying Cylinder",
    "MESH_CAPSULE",
)
