"""A box."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...errors import TactileError
from ...files.compiled import available
from .distance_loops import from_box
from .indenter import NEAREST, Indenter, check_length, contiguous, lengths, sign_of
from .scene_form import SceneForm, Size


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
        if available():
            return from_box(contiguous(points), self._middle, self._inner, self.edge)
        arm = points - self._middle
        out = np.abs(arm) - self._inner
        beyond = np.maximum(out, 0)
        corner = lengths(beyond)
        inside = np.flatnonzero(corner == 0)
        distance, far = corner - self.edge, corner
        if len(inside):
            face = np.argmax(out[inside], axis=1)
            distance[inside] += out[inside, face]
            beyond[inside, face], far = 1.0, corner.copy()
            far[inside] = 1.0
        return distance, np.copysign(beyond, arm) / far[:, None]

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter.curvature``; zero at faces, 1 / arm across round edges, in all tangents at corners."""
        arm = points - self._middle
        out = np.abs(arm) - self._inner
        beyond = np.copysign(np.maximum(out, 0), arm)
        length = np.maximum(lengths(beyond), NEAREST)[:, None, None]
        normal = beyond[:, :, None] / length
        round_axes = np.eye(3) * (out > 0)[:, None, :]
        return np.where((out > 0).sum(1)[:, None, None] > 1, (round_axes - normal * normal.swapaxes(1, 2)) / length, 0)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        return self._middle + self._inner * sign_of(direction) + self.edge * direction

    @functools.cached_property
    def _middle(self) -> np.ndarray:
        return np.array([0.0, 0.0, self.sizes[2] / 2])

    @functools.cached_property
    def _inner(self) -> np.ndarray:
        """Half-sizes (3,) m of the smaller box."""
        return np.array(self.sizes) / 2 - self.edge


SCENE = SceneForm(
    "box",
    Box,
    "The flat face of a box",
    {"sizes": Size("sizes_mm", slider="length", count=3), "edge": Size("edge_mm", 0.5, slider="edge")},
    "Box",
    "MESH_CUBE",
)
