"""A ring."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...errors import TactileError
from .circle import circle_curvature, circle_distance
from .indenter import SQUARE, Hull, Indenter, Surface, check_length
from .scene_form import SceneForm, Size

_ACROSS, _AROUND = 24, 64  # of the preview: nodes across and along the wire


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

    def preview(self, _hull: Hull) -> Surface:
        """See ``Indenter.preview``."""
        along = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)[:, None]
        across = np.linspace(0, 2 * np.pi, _ACROSS, endpoint=False)[None, :]
        reach = self.radius + self.tube * np.cos(across)
        height = self.tube + self.tube * np.sin(across)
        nodes = np.stack(np.broadcast_arrays(reach * np.cos(along), reach * np.sin(along), height), -1)
        a = np.arange(_AROUND * _ACROSS).reshape(_AROUND, _ACROSS)
        b = np.roll(a, -1, axis=0)
        c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
        quads = np.stack([a, b, c, d], -1).reshape(-1, 4)
        return nodes.reshape(-1, 3), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


SCENE = SceneForm(
    "ring",
    Ring,
    "A ring of round wire that lies flat",
    {"radius": Size("radius_mm", slider="radius"), "tube": Size("tube_mm", slider="tube")},
    "Ring",
    "MESH_TORUS",
)
