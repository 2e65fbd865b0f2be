"""An upright cylinder."""

from __future__ import annotations

import dataclasses
import functools
from typing import ClassVar

import numpy as np

from ...errors import TactileError
from ...files.compiled import Loop
from . import extrusion
from .indenter import NEAREST, SQUARE, Indenter, SceneForm, Size, check_length, contiguous, sign_of

_ORDER = {0: ([1, 2], [2, 0, 1]), 2: ([0, 1], [0, 1, 2])}  # axis -> axes across it; own axes from an extrusion's


@dataclasses.dataclass(frozen=True)
class Cylinder(Indenter):
    """An upright cylinder that touches with its flat end. radius, length : m; edge : m, radius of its rounded rims
    axis : index of its own axis of symmetry, set by the class"""

    radius: float
    edge: float
    length: float = 10e-3
    axis: ClassVar[int] = 2  # the own axis that it is round about

    def __post_init__(self) -> None:
        for name in ("radius", "edge", "length"):
            check_length("cylinder", name, getattr(self, name))
        if self.edge >= self.radius or 2 * self.edge >= self.length:
            raise TactileError("cylinder, edge", f"{self.edge * 1e3:g} mm", "less than radius and half the length")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the exact distance (n,) m and its gradient (n, 3); see ``Indenter.distance``."""
        inner, half = self.radius - self.edge, self.length / 2
        return _from_cylinder(contiguous(points), self.axis, self._middle, inner, half - self.edge, self.edge, NEAREST)

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's second derivatives (n, 3, 3) 1/m; see ``Indenter.curvature``."""
        arm, (across, own) = points - self._middle, _ORDER[self.axis]
        outline = extrusion.disc(arm[:, across], self.radius - self.edge)
        return extrusion.curvature(outline, arm[:, self.axis], self.length / 2 - self.edge)[:, own][:, :, own]

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the body's farthest point (3,) m along a direction (3,); see ``Indenter.support``."""
        across, inner = _ORDER[self.axis][0], np.zeros(3)
        ring = np.hypot(*direction[across])
        if ring > SQUARE:
            inner[across] = (self.radius - self.edge) * (direction[across] / ring)
        inner[self.axis] = (self.length / 2 - self.edge) * sign_of(direction[self.axis])
        return self._middle + inner + self.edge * direction

    @functools.cached_property
    def _middle(self) -> np.ndarray:
        return np.array([0.0, 0.0, self.length / 2 if self.axis == 2 else self.radius])


@Loop
def _from_cylinder(points, axis, middle, radius, half_span, edge, nearest):  # noqa: ANN001, ANN202
    """Return the distance (n,) m and gradient (n, 3) of points (n, 3) m from a cylinder along axis 0, 1 or 2, centre at
    middle (3,) m.
    radius, half_span : m, before it is inflated by ``edge`` m; nearest : m, least distance from the axis"""
    distance, gradient = np.empty(len(points)), np.empty((len(points), 3))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    for p in range(len(points)):
        x, y = points[p, first] - middle[first], points[p, second] - middle[second]
        along = points[p, axis] - middle[axis]
        length = np.sqrt(x * x + y * y)
        if length < nearest:
            x, y, length = 0.0, -nearest, nearest
        side, end = length - radius, abs(along) - half_span
        across, beyond = max(side, 0.0), max(end, 0.0)
        corner = np.sqrt(across * across + beyond * beyond)
        distance[p], far = corner - edge, corner
        if corner == 0:
            distance[p] += max(side, end)
            across, beyond, far = (1.0, 0.0, 1.0) if side > end else (0.0, 1.0, 1.0)
        gradient[p, first], gradient[p, second] = across / far * (x / length), across / far * (y / length)
        gradient[p, axis] = np.copysign(beyond / far, along)
    return distance, gradient


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
