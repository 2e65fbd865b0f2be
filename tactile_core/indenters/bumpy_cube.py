"""A cube with five bumps."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ..errors import TactileError
from .box import Box
from .circle import circle_curvature, circle_distance
from .indenter import NEAREST, Indenter, check_length
from .pose import Pose
from .several import Several
from .sphere import Sphere

_CUBE, _BALL, _RIM, _SHAFT = range(4)  # what is nearest


@dataclasses.dataclass(frozen=True)
class BumpyCube(Indenter):
    """A cube whose lower face carries five round bumps, placed like the dots of a die: it touches with their tips.

    size : m, of the cube; edge : m, radius of its edges
    bump_radius : m, of the balls that the bumps are part of; bump_height : m, by which they stand out of the face
    spacing : m, of the four outer bumps from the middle one, along x and along y
    """

    size: float
    edge: float
    bump_radius: float
    bump_height: float
    spacing: float

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            check_length("bumpy cube", field.name.replace("_", " "), getattr(self, field.name))
        if self.bump_height > self.bump_radius:
            found = f"{self.bump_height * 1e3:g} mm"
            raise TactileError("bumpy cube, bump height", found, "at most the bump radius: bumps are parts of balls")
        if self.spacing + self.bump_radius > self.size / 2 - self.edge:
            found = f"bumps reach {(self.spacing + self.bump_radius) * 1e3:g} mm from the middle"
            raise TactileError("bumpy cube, spacing", found, f"{(self.size / 2 - self.edge) * 1e3:g} mm or less")
        if np.sqrt(0.5) * self.spacing < self._foot:
            found, expected = f"{self.spacing * 1e3:g} mm", f"{np.sqrt(2) * self._foot * 1e3:g} mm or more"
            raise TactileError("bumpy cube, spacing", found, expected, "Bumps must not overlap")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact.

        Inside the cube above a bump the nearest place is on the bump's cap or on the rim at its foot: both lie below,
        unlike the surface of a whole ball.
        """
        nearest, distances, gradients, _ = self._branches(points)
        row = np.arange(len(points))
        return distances[nearest, row], gradients[nearest, row]

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter.curvature``."""
        nearest, _, _, at_bump = self._branches(points)
        curvature = np.empty((len(points), 3, 3))
        for branch, (indenter, pose) in ((_CUBE, self._parts[0]), (_SHAFT, self._shaft)):
            curvature[nearest == branch] = pose.curvature(indenter, points[nearest == branch])
        curvature[nearest == _BALL] = Sphere(self.bump_radius).curvature(at_bump[nearest == _BALL])
        rim = at_bump[nearest == _RIM] - [0.0, 0.0, self.bump_height]
        curvature[nearest == _RIM] = -circle_curvature(rim, self._foot)
        return curvature

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        return Several(self._parts).support(direction)

    @property
    def _foot(self) -> float:
        """Radius of the circle in which a bump meets the face, m."""
        return np.sqrt(self.bump_height * (2 * self.bump_radius - self.bump_height))

    @functools.cached_property
    def _tips(self) -> np.ndarray:
        s = self.spacing
        return np.array([[0.0, 0.0], [s, s], [s, -s], [-s, s], [-s, -s]])

    @functools.cached_property
    def _parts(self) -> tuple[tuple[Indenter, Pose], ...]:
        """The cube, then the balls."""
        ball = Sphere(self.bump_radius)
        cube = Box((self.size,) * 3, self.edge), Pose(np.array([0.0, 0.0, self.bump_height]), np.eye(3))
        return cube, *((ball, Pose(np.array([x, y, 0.0]), np.eye(3))) for x, y in self._tips)

    @functools.cached_property
    def _shaft(self) -> tuple[Indenter, Pose]:
        """The cube without its lower face, which is far away."""
        apex = np.array([0.0, 0.0, self.bump_height - self.size])
        return Box((self.size, self.size, 2 * self.size), self.edge), Pose(apex, np.eye(3))

    def _branches(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """What is nearest (n,); distances (4, n) and gradients (4, n, 3) of all; points in the nearest bump's frame."""
        across = points[:, None, :2] - self._tips
        nearest = np.argmin((across**2).sum(axis=2), axis=1)
        at_bump = np.column_stack([across[np.arange(len(points)), nearest], points[:, 2]])
        reach, toward = circle_distance(at_bump - [0.0, 0.0, self.bump_height], self._foot)
        cube, shaft = (pose.distance(indenter, points) for indenter, pose in (self._parts[0], self._shaft))
        ball = Sphere(self.bump_radius).distance(at_bump)
        distances, gradients = (np.stack(values) for values in zip(cube, ball, (-reach, -toward), shaft, strict=True))
        out, up = np.hypot(at_bump[:, 0], at_bump[:, 1]), points[:, 2]
        above = (out < self._foot) & (up >= self.bump_height)
        over_cap = out * (self.bump_radius - self.bump_height) <= self._foot * (self.bump_radius - up)
        below = np.where(over_cap & (up < self.bump_radius - NEAREST), _BALL, _RIM)
        row = np.arange(len(points))
        branch = np.where(distances[_CUBE] <= distances[_BALL], _CUBE, _BALL)
        inside = np.where(distances[_SHAFT] > distances[below, row], _SHAFT, below)
        return np.where(above, inside, branch), distances, gradients, at_bump
