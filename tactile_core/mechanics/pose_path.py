"""Poses between two poses of an indenter."""

from __future__ import annotations

import numpy as np

from ..geometry.indenters import Pose

_ROUNDING = 1e-12  # m


def same_place(first: Pose, second: Pose) -> bool:
    """Return true if two poses are equal."""
    return np.array_equal(first.apex, second.apex) and np.array_equal(first.axes, second.axes)


def same_line(first: Pose, second: Pose) -> bool:
    """Return true if two poses differ in depth alone."""
    apart = second.apex - first.apex
    sideways = apart - (apart @ first.direction) * first.direction
    return bool(np.abs(sideways).max() < _ROUNDING and np.array_equal(first.axes, second.axes))


def between(first: Pose, second: Pose, share: float) -> Pose:
    """Return the pose at a share 0..1 of the way: apex on a straight line, axes turned about one axis (Rodrigues)."""
    apex = first.apex + share * (second.apex - first.apex)
    turn = second.axes @ first.axes.T
    twice = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    size = np.linalg.norm(twice)
    angle = np.arctan2(size, np.trace(turn) - 1)
    if size < 1e-15:
        return Pose(apex, second.axes, second.push)
    x, y, z = twice / size
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    part = np.eye(3) + np.sin(share * angle) * cross + (1 - np.cos(share * angle)) * (cross @ cross)
    return Pose(apex, part @ first.axes, second.push)
