"""Obstacle that a solid may touch: a rigid body with a distance, its normal and its curvature."""

from __future__ import annotations

import dataclasses
from typing import Protocol

import numpy as np

from ...geometry.indenters import Indenter, Pose


class Obstacle(Protocol):
    """A rigid body in the sensor's frame."""

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance (n,) m, positive outside, and unit normal (n, 3) at points (n, 3) m."""

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the second derivatives (n, 3, 3) 1/m of the distance."""


@dataclasses.dataclass(frozen=True)
class PlacedIndenter:
    """An indenter at a pose."""

    indenter: Indenter
    pose: Pose

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Obstacle``."""
        return self.pose.distance(self.indenter, points)

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Obstacle``."""
        return self.pose.curvature(self.indenter, points)
