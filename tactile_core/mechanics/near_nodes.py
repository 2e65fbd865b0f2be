"""Which nodes of a resting surface an indenter may reach."""

from __future__ import annotations

import numpy as np

from ..indenters import Indenter, Pose

_FARTHEST = 1e-3  # m, of a pose from the one at which all distances are known: beyond it they rule out few (assumed)
_STEEPEST = 1.1  # of a distance: 1, but for smooth grids of it (assumed)


class NearNodes:
    """Looks at all of the nodes ``rest`` (n, 3) m once, then only at those that what was seen does not rule out."""

    def __init__(self, indenter: Indenter, rest: np.ndarray) -> None:
        self._indenter, self._rest = indenter, rest
        self._pose: Pose | None = None
        self._gap = np.empty(0)

    def within(self, pose: Pose, reach: float) -> np.ndarray:
        """Sorted nodes (k,) that lie less than ``reach`` m outside the indenter at a pose, or in it."""
        apart = np.inf
        if self._pose is not None and self._pose.axes is pose.axes:
            apart = float(np.linalg.norm(pose.apex - self._pose.apex))
        if apart > _FARTHEST:
            self._pose, self._gap = pose, pose.distance(self._indenter, self._rest)[0]
            return np.flatnonzero(self._gap < reach)
        some = np.flatnonzero(self._gap < reach + _STEEPEST * apart)
        return some[pose.distance(self._indenter, self._rest[some])[0] < reach]
