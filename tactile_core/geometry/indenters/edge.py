"""A straight edge."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...errors import TactileError, finite_number
from . import extrusion
from .indenter import NEAREST, SQUARE, Indenter, SceneForm, Size, check_length, sign_of

_ACROSS, _OWN = [1, 2], [2, 0, 1]  # own axes across; own axes from an extrusion's, which are y, z, x
_ANGLES = np.deg2rad([10, 170])  # a sharper wedge is a blade, a blunter one a plane


@dataclasses.dataclass(frozen=True)
class Edge(Indenter):
    """A wedge that touches with its ridge, which runs along the own x.

    angle : rad, between its flanks; radius : m, of the ridge and all other edges; length, height : m, of the body
    """

    angle: float
    radius: float
    length: float = 20e-3
    height: float = 10e-3

    def __post_init__(self) -> None:
        for name in ("radius", "length", "height"):
            check_length("edge", name, getattr(self, name))
        finite_number(self.angle, "edge, angle", "0.17 to 2.97 rad, 10 to 170 degrees", *_ANGLES)
        if 2 * self.radius >= min(self.length, self.height):
            raise TactileError("edge, radius", f"{self.radius * 1e3:g} mm", "less than half of length and height")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the exact signed distance (n,) m of points (n, 3) m, that of a smaller wedge less the edges' radius,
        and its gradient (n, 3); see ``Indenter.distance``."""
        distance, gradient = extrusion.distance(*self._prism(points), self.radius)
        return distance, gradient[:, _OWN]

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's second derivatives (n, 3, 3) 1/m; see ``Indenter.curvature``."""
        return extrusion.curvature(*self._prism(points))[:, _OWN][:, :, _OWN]

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the body's farthest point (3,) m along a direction (3,); see ``Indenter.support``."""
        corners = self._corners()
        reach = corners @ direction[1:]
        y, z = corners[reach > reach.max() - SQUARE * self.height].mean(axis=0)
        x = (self.length / 2 - self.radius) * sign_of(direction[0])
        return np.array([x, y, z]) + self.radius * direction

    def _corners(self) -> np.ndarray:
        """Return the corners (3, 2) m of the smaller wedge's cross section, counterclockwise in (y, z)."""
        rise = self.height - 2 * self.radius
        half_width = rise * np.tan(self.angle / 2)
        corners = np.array([[0, 0], [half_width, rise], [-half_width, rise]])
        return corners + np.array([0, self.radius])

    def _prism(self, points: np.ndarray) -> tuple[extrusion.Outline, np.ndarray, float]:
        return _polygon(points[:, _ACROSS], self._corners()), points[:, 0], self.length / 2 - self.radius


def _polygon(across: np.ndarray, corners: np.ndarray) -> extrusion.Outline:
    """Return the outline, at places ``across`` (n, 2) m, of a convex polygon with counterclockwise corners (k, 2) m."""
    side = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(side, axis=1)
    normals = np.column_stack([side[:, 1], -side[:, 0]]) / length[:, None]
    arm = across[:, None] - corners
    beyond = np.einsum("nkd,kd->nk", arm, normals)
    foot = np.clip(np.einsum("nkd,kd->nk", arm, side) / length**2, 0, 1)
    arm = arm - foot[:, :, None] * side
    inside = (beyond <= 0).all(axis=1)
    nearest = np.where(inside, beyond.argmax(axis=1), np.linalg.norm(arm, axis=2).argmin(axis=1))
    row = np.arange(len(across))
    arm, foot, value = arm[row, nearest], foot[row, nearest], beyond[row, nearest]
    reach = np.linalg.norm(arm, axis=1)
    at_corner = ~inside & ((foot <= 0) | (foot >= 1)) & (reach > NEAREST)
    slope = np.where(at_corner[:, None], arm / np.maximum(reach, NEAREST)[:, None], normals[nearest])
    return extrusion.Outline(np.where(at_corner, reach, value), slope, np.where(at_corner, reach, np.inf))


SCENE = SceneForm(
    "edge",
    Edge,
    "The rounded ridge of a wedge along the finger",
    {
        "angle": Size("angle_deg", slider="angle"),
        "radius": Size("radius_mm", 0.5, slider="edge"),
        "length": Size("length_mm", 20.0, slider="length"),
        "height": Size("height_mm", 10.0),
    },
    "Edge",
    "MESH_CONE",
)
