"""A cube with five bumps."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...errors import TactileError
from .box import Box
from .indenter import NEAREST, Hull, Indenter, Pose, SceneForm, Size, Surface, check_length
from .ring import circle_curvature, circle_distance
from .several import Several, joined
from .sphere import Sphere

_CUBE, _BALL, _RIM, _SHAFT = range(4)  # the nearest part


@dataclasses.dataclass(frozen=True)
class BumpyCube(Indenter):
    """A cube whose lower face carries five round bumps, placed like the dots of a die: it touches with their tips.

    size : m, of the cube; edge : m, radius of its edges
    bump_radius : m, of the balls that the bumps are part of; bump_height : m, by which they stand out of the face
    spacing : m, distance of the four outer bumps from the middle one, along x and along y
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
        """Return the exact distance (n,) m and its gradient (n, 3); see ``Indenter.distance``.

        Inside the cube above a bump the nearest surface is the bump's cap or the rim at its foot, both below; the
        ball's upper part is no surface there.
        """
        _, distance, gradient, _ = self._nearest(points)
        return distance, gradient

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's second derivatives (n, 3, 3) 1/m; see ``Indenter.curvature``."""
        nearest, _, _, at_bump = self._nearest(points)
        curvature = np.empty((len(points), 3, 3))
        for branch, (indenter, pose) in ((_CUBE, self._parts[0]), (_SHAFT, self._shaft)):
            curvature[nearest == branch] = pose.curvature(indenter, points[nearest == branch])
        curvature[nearest == _BALL] = Sphere(self.bump_radius).curvature(at_bump[nearest == _BALL])
        rim = at_bump[nearest == _RIM] - [0.0, 0.0, self.bump_height]
        curvature[nearest == _RIM] = -circle_curvature(rim, self._foot)
        return curvature

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the body's farthest point (3,) m along a direction (3,); see ``Indenter.support``."""
        return Several(self._parts).support(direction)

    def preview(self, hull: Hull) -> Surface:
        """Return nodes (n, 3) m and triangles (m, 3) that show the body; see ``Indenter.preview``."""
        return joined(self._parts, hull)

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
        """The cube with its lower face moved far down."""
        apex = np.array([0.0, 0.0, self.bump_height - self.size])
        return Box((self.size, self.size, 2 * self.size), self.edge), Pose(apex, np.eye(3))

    def _nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the number (n,) of the part nearest to points (n, 3) m, its distance (n,) m and gradient (n, 3), and
        the points (n, 3) m in the frame of the bump next to each."""
        outer = np.copysign(self.spacing, points[:, :2])
        outer[np.abs(points[:, 0]) + np.abs(points[:, 1]) <= self.spacing] = 0.0
        at_bump = points.copy()
        at_bump[:, :2] -= outer
        (cube, pose), ball = self._parts[0], self._parts[1][0]
        distance, gradient = cube.distance(points - pose.apex)
        of_ball, from_ball = ball.distance(at_bump)
        branch = np.where(distance <= of_ball, _CUBE, _BALL)
        distance = np.minimum(distance, of_ball)
        gradient = np.where((branch == _CUBE)[:, None], gradient, from_ball)
        above = (points[:, 2] >= self.bump_height) & (np.hypot(at_bump[:, 0], at_bump[:, 1]) < self._foot)
        if above.any():
            there = (each[above] for each in (points, at_bump, of_ball, from_ball))
            branch[above], distance[above], gradient[above] = self._above(*there)
        return branch, distance, gradient, at_bump

    def _above(self, points, at_bump, of_ball, from_ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # noqa: ANN001
        """Return the part nearest to points (n, 3) m that lie in the cube above a bump, its distance and gradient.
        at_bump : points in the frame of their bump's ball; of_ball, from_ball : its distance and gradient there
        """
        reach, toward = circle_distance(at_bump - [0.0, 0.0, self.bump_height], self._foot)
        shaft, pose = self._shaft
        of_shaft, from_shaft = shaft.distance(points - pose.apex)
        out, up = np.hypot(at_bump[:, 0], at_bump[:, 1]), points[:, 2]
        over_cap = out * (self.bump_radius - self.bump_height) <= self._foot * (self.bump_radius - up)
        capped = over_cap & (up < self.bump_radius - NEAREST)
        below = np.where(capped, of_ball, -reach)
        toward = np.where(capped[:, None], from_ball, -toward)
        beside = of_shaft > below
        branch = np.where(beside, _SHAFT, np.where(capped, _BALL, _RIM))
        return branch, np.where(beside, of_shaft, below), np.where(beside[:, None], from_shaft, toward)


SCENE = SceneForm(
    "bumpy_cube",
    BumpyCube,
    "A cube with five bumps on its lower face, placed like the dots of a die",
    {
        "size": Size("size_mm"),
        "bump_radius": Size("bump_radius_mm"),
        "bump_height": Size("bump_height_mm"),
        "spacing": Size("spacing_mm"),
        "edge": Size("edge_mm", 0.5),
    },
)
