"""Sharpness of an indenter where a surface lies: edges too fine for the lattices are solved less well."""

from __future__ import annotations

import numpy as np

from ..geometry.indenters import Indenter, Pose

# m, of edges below which the fast tier's errors are taken to grow as the width of the contact falls, by the root of the
# radius (its form assumed). Shapes of 96 of 101 wedges and bumps of 0.2 to 1 mm were then off the full tier by no more
# than stated, forces of 98; with 0.4 mm and without the root 81 and 91 were. Those of 0.1 mm, off 1.8 to 2.7 times the
# table's, are covered too.
RESOLVED_RADIUS = 1.5e-3
# m, of the sharpest edges that are held out between a surface's nodes as well: round a wedge of 0.1 mm the gel found no
# shape between its own, and took two minutes to say so; edges of 0.4 mm are held.
BENDS = 0.2e-3
_LEAST_RADIUS = 10e-6  # m, below which an edge acts like one of this radius
_NEAR = 0.5e-3  # m, from the indenter: farther off it may be as sharp as it likes


def sharpest(indenter: Indenter, pose: Pose, points: np.ndarray) -> float:
    """Return an indenter's least radius of curvature, m, at its tip and near those points (n, 3) m outside it."""
    points = np.concatenate([points, pose.support(indenter, pose.direction)[None]])  # no node may be near a blade's
    gap, _ = pose.distance(indenter, points)
    near = (gap > -_LEAST_RADIUS) & (gap < _NEAR)
    if not near.any():
        return np.inf
    bend = pose.curvature(indenter, points[near])  # of the level surface through each point
    total, square = np.einsum("kii->k", bend), np.einsum("kij,kij->k", bend, bend)
    larger = (total + np.sqrt(np.maximum(2 * square - total**2, 0.0))) / 2  # of the two principal curvatures
    radius = 1 / np.maximum(larger, 1e-9) - np.maximum(gap[near], 0.0)
    return max(float(radius.min()), _LEAST_RADIUS)
