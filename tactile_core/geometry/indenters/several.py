"""Several bodies that move together."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np

from ...errors import TactileError
from .indenter import SQUARE, Hull, Indenter, Pose, Surface

_TOUCH = 1e-9  # m, how well the lowest part must touch the plane z = 0


@dataclasses.dataclass(frozen=True)
class Several(Indenter):
    """A rigid group of indenters, for several contacts at once; the nearest part decides.

    Its distance is exact outside. Inside, in overlaps of parts, the true depth is at least the one returned.

    parts : pairs of an indenter and its ``Pose`` in the group's frame; the lowest of them touches z = 0"""

    parts: tuple[tuple[Indenter, Pose], ...]

    def __post_init__(self) -> None:
        try:
            pairs = [(hasattr(body, "curvature"), pose) for body, pose in self.parts]
        except (TypeError, ValueError):  # no pairs
            pairs = []
        if not pairs or not all(presses and isinstance(pose, Pose) for presses, pose in pairs):
            raise TactileError("several, parts", f"{self.parts!r:.80}", "one indenter or more, each with its Pose")
        for _, pose in pairs:
            pose.check("several, parts")
        lowest = float(self.support(np.array([0.0, 0.0, -1.0]))[2])
        if abs(lowest) > _TOUCH:
            advice = "Raise or lower all parts together"
            raise TactileError("several, parts", f"the lowest reaches z = {lowest * 1e3:g} mm", "z = 0", advice)

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest part's distance (n,) m and gradient (n, 3); see ``Indenter.distance``."""
        distance, gradient, _ = self._nearest(points)
        return distance, gradient

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the second derivatives (n, 3, 3) 1/m of the nearest part's distance; see ``Indenter.curvature``."""
        nearest = self._nearest(points)[2]
        curvature = np.empty((len(points), 3, 3))
        for k, (indenter, pose) in enumerate(self.parts):
            curvature[nearest == k] = pose.curvature(indenter, points[nearest == k])
        return curvature

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the farthest (3,) m of the parts' support points along a direction (3,), the mean of equally far ones;
        see ``Indenter.support``."""
        places = np.array([pose.support(indenter, direction) for indenter, pose in self.parts])
        reach = places @ direction
        return places[reach > reach.max() - SQUARE].mean(axis=0)

    def preview(self, hull: Hull) -> Surface:
        """Return nodes (n, 3) m and triangles (m, 3) that show the body; see ``Indenter.preview``."""
        return joined(self.parts, hull)

    def _nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the distance (n,) m of points (n, 3) m to the nearest part, its gradient (n, 3), and the part's index
        (n,)."""
        answers = [pose.distance(indenter, points) for indenter, pose in self.parts]
        nearest = np.argmin([distance for distance, _ in answers], axis=0)
        row = np.arange(len(points))
        distance, gradient = (np.stack(values)[nearest, row] for values in zip(*answers, strict=True))
        return distance, gradient, nearest


def joined(parts: Iterable[tuple[Indenter, Pose]], hull: Hull) -> Surface:
    """Return one surface that shows all ``parts``, pairs of a body and its pose; hull : as in ``Indenter.preview``"""
    nodes, faces, count = [], [], 0
    for body, pose in parts:
        own, triangles = body.preview(hull)
        nodes.append(pose.from_own(own))
        faces.append(triangles + count)
        count += len(own)
    return np.concatenate(nodes), np.concatenate(faces)
