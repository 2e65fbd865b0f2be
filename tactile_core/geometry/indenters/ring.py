"""A ring."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...errors import TactileError
from ...files.compiled import Loop
from .indenter import NEAREST, SQUARE, Hull, Indenter, SceneForm, Size, Surface, check_length, contiguous

_ACROSS, _AROUND = 24, 64  # of the preview: nodes across and along the wire


@dataclasses.dataclass(frozen=True)
class Ring(Indenter):
    """A torus that lies flat: a round wire of radius ``tube``, m, whose middle is a circle of ``radius``, m.

    Its outer diameter is 2 (radius + tube). Its own origin is below the hole's middle, in the plane on which it lies.
    """

    radius: float
    tube: float

    def __post_init__(self) -> None:
        for name in ("radius", "tube"):
            check_length("ring", name, getattr(self, name))
        if self.tube >= self.radius:
            raise TactileError("ring, tube", f"{self.tube * 1e3:g} mm", "less than the radius of the ring's middle")

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the exact distance (n,) m and its gradient (n, 3); see ``Indenter.distance``."""
        above = points.copy()
        above[:, 2] -= self.tube
        length, gradient = circle_distance(above, self.radius)
        return length - self.tube, gradient

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's second derivatives (n, 3, 3) 1/m; see ``Indenter.curvature``."""
        return circle_curvature(points - [0.0, 0.0, self.tube], self.radius)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the body's farthest point (3,) m along a direction (3,); see ``Indenter.support``."""
        across = np.hypot(direction[0], direction[1])
        radial = np.array([direction[0], direction[1], 0.0]) / across if across > SQUARE else np.zeros(3)
        return np.array([0.0, 0.0, self.tube]) + self.radius * radial + self.tube * direction

    def preview(self, _hull: Hull) -> Surface:
        """Return nodes (n, 3) m and triangles (m, 3) that show the body; see ``Indenter.preview``."""
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


def circle_distance(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance (n,) m of points (n, 3) m from a circle about z of ``radius`` m, and its gradient (n, 3)."""
    return _from_circle(contiguous(points), radius, NEAREST)


def circle_curvature(points: np.ndarray, radius: float) -> np.ndarray:
    """Return the second derivatives (n, 3, 3) 1/m of ``circle_distance``, d, at points (n, 3) m. With r the distance
    from the axis, the eigenvalues are 1 / d (round the wire), (r - radius) / (d r) (along it) and 0 (outward)."""
    around, radial, arm, length = _arms(points, radius)
    turn = np.column_stack([-arm[:, 1:] * radial, arm[:, 0]])
    along = np.column_stack([-radial[:, 1], radial[:, 0], np.zeros(len(points))])
    hoop = arm[:, 0] / length / np.maximum(around, NEAREST)
    return _square(turn) / length[:, None, None] ** 3 + hoop[:, None, None] * _square(along)


def _arms(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return, for points (n, 3) m and a circle of radius m about z: the distance (n,) m from the axis, the direction
    (n, 2) from it, and the arm from the circle, (outward, z) (n, 2) m, and its length (n,) m."""
    across = points[:, :2]
    around = np.sqrt(np.einsum("ni,ni->n", across, across))
    radial = across / np.maximum(around, NEAREST)[:, None]
    radial[around < NEAREST] = [1.0, 0.0]
    arm = np.empty((len(points), 2))
    arm[:, 0], arm[:, 1] = around - radius, points[:, 2]
    length = np.sqrt(np.einsum("ni,ni->n", arm, arm))
    arm[length < NEAREST] = [0.0, -NEAREST]
    return around, radial, arm, np.maximum(length, NEAREST)


def _square(vectors: np.ndarray) -> np.ndarray:
    """Return the outer product (n, 3, 3) of each of vectors (n, 3) with itself."""
    return vectors[:, :, None] * vectors[:, None, :]


@Loop
def _from_circle(points, radius, nearest):  # noqa: ANN001, ANN202
    """Compute ``circle_distance`` of points (n, 3) m in a loop; radius : m; nearest : m, least distance that divides"""
    distance, gradient = np.empty(len(points)), np.empty((len(points), 3))
    for p in range(len(points)):
        x, y, above = points[p, 0], points[p, 1], points[p, 2]
        around = np.sqrt(x * x + y * y)
        right, up = (x / around, y / around) if around >= nearest else (1.0, 0.0)
        outward = around - radius
        length = np.sqrt(outward * outward + above * above)
        if length < nearest:
            outward, above, length = 0.0, -nearest, nearest
        distance[p] = length
        gradient[p, 0], gradient[p, 1] = outward * right / length, outward * up / length
        gradient[p, 2] = above / length
    return distance, gradient


SCENE = SceneForm(
    "ring",
    Ring,
    "A ring of round wire that lies flat",
    {"radius": Size("radius_mm", slider="radius"), "tube": Size("tube_mm", slider="tube")},
    "Ring",
    "MESH_TORUS",
)
