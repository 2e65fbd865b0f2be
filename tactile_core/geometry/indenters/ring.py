"""A ring."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...errors import TactileError
from .circle import circle_curvature, circle_distance
from .indenter import SQUARE, Indenter, check_length


@dataclasses.dataclass(frozen=True)
class Ring(Indenter):
    """A torus that lies flat: a round wire of radius ``tube`` whose middle is a circle of ``radius``, m.

    Its outer diameter is 2 (radius + tube). Its own origin is in the plane below the hole's middle.
    """

    radius: float
    tube: float

    def __post_init__(self) -> None:
        for name in ("radius", "tube"):
            check_length("ring", name, getattr(self, name))
        if self.tube >= self.radius:
            raise TactileError("ring, tube", f"{self.tube * 1e3:g} mm", "less than the radius of the ring's middle")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact."""
        above = points.copy()
        above[:, 2] -= self.tube
        length, gradient = circle_distance(above, self.radius)
        return length - self.tube, gradient

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter.curvature``."""
        return circle_curvature(points - [0.0, 0.0, self.tube], self.radius)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        across = np.hypot(direction[0], direction[1])
        radial = np.array([direction[0], direction[1], 0.0]) / across if across > SQUARE else np.zeros(3)
        return np.array([0.0, 0.0, self.tube]) + self.radius * radial + self.tube * direction
