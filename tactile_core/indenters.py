"""Rigid indenters by signed distance. A new one is one class here (or one file) and one test row.

In its own frame an indenter touches the plane z = 0 at the origin from above: its body lies at z >= 0.
"""

from __future__ import annotations

import dataclasses
from typing import Protocol

import numpy as np

from .errors import TactileError


class Indenter(Protocol):
    """A rigid body given by its signed distance."""

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) m, positive outside, and its gradient (n, 3), at points (n, 3) m in the own frame."""

    def support(self, direction: np.ndarray) -> np.ndarray:
        """The point (3,) m of the body that lies farthest along a unit vector (3,), in the own frame."""


@dataclasses.dataclass(frozen=True)
class Sphere:
    """A ball of the given radius, m."""

    radius: float

    def __post_init__(self) -> None:
        _check_length("sphere", "radius", self.radius)

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact."""
        arm = points - [0.0, 0.0, self.radius]
        length = np.linalg.norm(arm, axis=1)
        return length - self.radius, arm / np.maximum(length, 1e-12)[:, None]

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``."""
        return np.array([0.0, 0.0, self.radius]) + self.radius * direction


@dataclasses.dataclass(frozen=True)
class Cylinder:
    """An upright cylinder that touches with its flat end; ``edge`` rounds the rim. Lengths in m."""

    radius: float
    edge: float
    length: float = 10e-3

    def __post_init__(self) -> None:
        for name in ("radius", "edge", "length"):
            _check_length("cylinder", name, getattr(self, name))
        if self.edge >= self.radius or 2 * self.edge >= self.length:
            raise TactileError("cylinder, edge", f"{self.edge * 1e3:g} mm", "less than radius and half the length")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter.distance``; exact (a shrunken cylinder, inflated by the edge radius)."""
        ring = np.hypot(points[:, 0], points[:, 1])
        radial = np.zeros_like(points)
        radial[:, :2] = points[:, :2] / np.maximum(ring, 1e-12)[:, None]
        height = points[:, 2] - self.length / 2
        upward = np.zeros_like(points)
        upward[:, 2] = np.where(height >= 0, 1.0, -1.0)
        out_r = ring - (self.radius - self.edge)
        out_z = np.abs(height) - (self.length / 2 - self.edge)
        corner_r, corner_z = np.maximum(out_r, 0), np.maximum(out_z, 0)
        corner = np.hypot(corner_r, corner_z)
        distance = corner + np.minimum(np.maximum(out_r, out_z), 0) - self.edge
        outside = (corner_r[:, None] * radial + corner_z[:, None] * upward) / np.maximum(corner, 1e-12)[:, None]
        inside = np.where((out_r > out_z)[:, None], radial, upward)
        return distance, np.where((corner > 0)[:, None], outside, inside)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter.support``; the middle of an end or a side where a whole flat or line lies farthest."""
        ring = np.hypot(direction[0], direction[1])
        radial = np.array([direction[0], direction[1], 0.0]) / max(ring, 1e-12) * (ring > 1e-9)
        upward = np.array([0.0, 0.0, np.sign(direction[2]) * (abs(direction[2]) > 1e-9)])
        inner = (self.radius - self.edge) * radial + (self.length / 2 - self.edge) * upward
        return np.array([0.0, 0.0, self.length / 2]) + inner + self.edge * direction


@dataclasses.dataclass(frozen=True)
class Pose:
    """Where an indenter stands: its own origin at ``apex`` (3,) m, its own axes as the columns of ``axes`` (3, 3)."""

    apex: np.ndarray
    axes: np.ndarray

    @property
    def direction(self) -> np.ndarray:
        """Unit vector (3,) into the sensor: the indenter's own -z."""
        return -self.axes[:, 2]

    def moved(self, depth: float) -> Pose:
        """The pose after moving ``depth`` m along ``direction``."""
        return Pose(self.apex + depth * self.direction, self.axes)

    def distance(self, indenter: Indenter, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) m and gradient (n, 3) of the placed indenter at sensor points (n, 3) m."""
        distance, gradient = indenter.distance((points - self.apex) @ self.axes)
        return distance, gradient @ self.axes.T


def pose_on(
    indenter: Indenter, point: np.ndarray, outward: np.ndarray, tilt: float = 0.0, tilt_heading: float = 0.0
) -> Pose:
    """An indenter that just touches ``point`` (3,) m of a surface with unit normal ``outward`` (3,).

    tilt : rad, between its axis (the way it moves) and that normal
    tilt_heading : rad, the way its upper end leans: 0 toward +x of the finger, pi / 2 (on the pad) toward -z
    """
    along = np.array([1.0, 0.0, 0.0]) - outward[0] * outward
    along /= np.linalg.norm(along)
    side = np.cross(along, outward)
    axis = np.cos(tilt) * outward + np.sin(tilt) * (np.cos(tilt_heading) * along + np.sin(tilt_heading) * side)
    first = along - axis * (along @ axis)
    first /= np.linalg.norm(first)
    axes = np.column_stack([first, np.cross(axis, first), axis])
    return Pose(point - axes @ indenter.support(-outward @ axes), axes)


def _check_length(kind: str, name: str, value: float) -> None:
    if not (np.isfinite(value) and 1e-6 < value < 1.0):
        raise TactileError(
            f"{kind}, {name}",
            f"{value!r} m",
            "a length between 0.001 mm and 1 m",
            "Check the unit: scenes give millimetres",
        )
