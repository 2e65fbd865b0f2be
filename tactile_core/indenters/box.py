"""A box."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..errors import TactileError
from .indenter import NEAREST, Indenter, check_length, sign_of


@dataclasses.dataclass(frozen=True)
class Box(Indenter):
    """A box along the own axes that touches with its flat lower face; ``edge`` rounds edges and corners.

    sizes : three full lengths along x, y, z, m; edge : m
    """

    sizes: tuple[float, float, float]
    edge: float

    def __post_init__(self) -> None:
        for name, value in zip(("size x", "size y", "size z", "edge"), (*self.sizes, self.edge), strict=True):
            check_length("box", name, value)
        if 2 * self.edge >= min(self.sizes):
            raise TactileError("box, edge", f"{self.edge * 1e3:g} mm", "less than half of the smallest size")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact (a smaller box inflated by the edge radius), inside to the nearest face."""
        out, sign = self._out(points)
        beyond = np.maximum(out, 0)
        corner = np.linalg.norm(beyond, axis=1)
        nearest_face = np.eye(3)[np.argmax(out, axis=1)]
        outside = (corner > 0)[:, None]
        normal = np.where(outside, beyond / np.where(outside, corner[:, None], 1), nearest_face)
        return corner + np.minimum(out.max(axis=1), 0) - self.edge, normal * sign

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter.curvature``; zero at faces, 1 / arm across round edges, in all tangents at corners."""
        out, sign = self._out(points)
        beyond = np.maximum(out, 0) * sign
        length = np.maximum(np.linalg.norm(beyond, axis=1), NEAREST)[:, None, None]
        normal = beyond[:, :, None] / length
        round_axes = np.eye(3) * (out > 0)[:, None, :]
        return np.where((out > 0).sum(1)[:, None, None] > 1, (round_axes - normal * normal.swapaxes(1, 2)) / length, 0)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        inner = (np.array(self.sizes) / 2 - self.edge) * sign_of(direction)
        return np.array([0.0, 0.0, self.sizes[2] / 2]) + inner + self.edge * direction

    def _out(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far each coordinate is beyond the smaller box (n, 3) m, and on which side (n, 3)."""
        arm = points - [0.0, 0.0, self.sizes[2] / 2]
        return np.abs(arm) - (np.array(self.sizes) / 2 - self.edge), np.where(arm >= 0, 1.0, -1.0)
