"""Blocks of neighbouring nodes, to skip the large part of a surface that is far from an indenter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .indenters import Indenter, Pose

_SIDE = 6  # nodes: blocks of so many by so many cost least to look at, few blocks and few nodes in each
_STEEPEST = 1.1  # of a distance: 1, but for smooth grids of it (assumed)


class LatticeBlocks:
    """Blocks of nodes ``rest`` (n, 3) m on a grid of ``shape`` (rows, columns); each node after the grid is a block."""

    def __init__(self, rest: np.ndarray, shape: tuple[int, int]) -> None:
        row, column = np.divmod(np.arange(shape[0] * shape[1]), shape[1])
        across = -(-shape[1] // _SIDE)
        label = row // _SIDE * across + column // _SIDE
        poles = np.arange(len(rest) - len(label))
        self._rest, self._label = rest, np.concatenate([label, label.max() + 1 + poles])
        blocks = [rest[self._label == block] for block in range(self._label.max() + 1)]
        self._centre = np.array([(nodes.min(axis=0) + nodes.max(axis=0)) / 2 for nodes in blocks])
        self._radius = np.array([
            np.linalg.norm(nodes - centre, axis=1).max() for nodes, centre in zip(blocks, self._centre, strict=True)
        ])  # fmt: skip

    def near(self, indenter: Indenter, pose: Pose, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Find the nodes (k,), sorted, inside an indenter or nearer than ``reach`` m, and their distances (k,) m."""
        close = pose.distance(indenter, self._centre)[0] < reach + _STEEPEST * self._radius
        nodes = np.flatnonzero(close.take(self._label))
        gap = pose.distance(indenter, self._rest.take(nodes, axis=0))[0]
        found = gap < reach
        return nodes[found], gap[found]
