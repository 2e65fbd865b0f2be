"""Base class of indenters, and the checks that all of them share."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Protocol

import numpy as np

from ...errors import TactileError

# Where a direction meets a flat or a line of the body squarely, rounding must not choose an end of it.
SQUARE = 1e-9
# m; nearer than this to a centre of curvature (deep inside a body) normals and curvatures are those at this distance.
NEAREST = 1e-9

Surface = tuple[np.ndarray, np.ndarray]  # nodes (n, 3) m in the body's frame, triangles (m, 3)
Hull = Callable[[Callable[[np.ndarray], np.ndarray]], Surface]  # surface of a convex body, by its ``support``


class Indenter(Protocol):
    """A rigid body given by its signed distance. Shapes inherit from it."""

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the signed distance (n,) m, positive outside, and its gradient (n, 3), at points (n, 3) m."""

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the symmetric second derivatives (n, 3, 3) 1/m of the distance at points (n, 3) m in the own frame.

        They belong to the same branch as ``distance``'s gradient; on creases, a thin set, one side's are given.
        """

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the point (3,) m of the body's convex hull farthest along a unit vector (3,), in the own frame.

        Where a whole flat, circle or line lies farthest, its middle.
        """

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner (3,) m of the smallest box along the own axes that holds the body."""
        lower = [self.support(-axis)[k] for k, axis in enumerate(np.eye(3))]
        upper = [self.support(axis)[k] for k, axis in enumerate(np.eye(3))]
        return np.array(lower), np.array(upper)

    def preview(self, hull: Hull) -> Surface:
        """Return the nodes (n, 3) m and triangles (m, 3) that show the body; those of a convex one are its hull's."""
        return hull(self.support)

    @functools.cached_property
    def least_side(self) -> float:
        """The least side, m, of the box of ``bounds``."""
        lower, upper = self.bounds()
        return float((upper - lower).min())


def contiguous(points: np.ndarray) -> np.ndarray:
    """Return points (n, 3) m as compiled loops take them."""
    return np.ascontiguousarray(points, float)


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths (n,) of vectors (n, 3), in half of ``np.linalg.norm``'s time where they are few."""
    return np.sqrt(np.einsum("ai,ai->a", vectors, vectors))


def check_length(kind: str, name: str, value: float) -> None:
    """Raise TactileError for a length that is no number between 0.001 mm and 1 m."""
    if not (np.isfinite(value) and 1e-6 < value < 1.0):
        raise TactileError(
            f"{kind}, {name}",
            f"{value!r} m",
            "a length between 0.001 mm and 1 m",
            "Check the unit: scenes give millimetres",
        )


def sign_of(component: np.ndarray | float) -> np.ndarray:
    """Return -1, 0 or 1; 0 for components of a direction that are zero up to rounding."""
    return np.where(np.abs(component) > SQUARE, np.sign(component), 0.0)
