"""Points halfway between the nodes of a surface's lattice, each hung on it by a spring."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...geometry.catmull_rom import stencil
from ...geometry.lattice import Lattice
from .compliance import Compliance
from .compliance_rows import ComplianceRows


class InterpolatedPoints(NamedTuple):
    """Points of the surface's cubic interpolation; nodes, weights : (v, 16), of the sums of nodes that they are."""

    nodes: np.ndarray
    weights: np.ndarray

    def interpolate(self, values: np.ndarray) -> np.ndarray:
        """Interpolate the values (v, 3) at the points from those at all touchable nodes (m, 3)."""
        return np.einsum("vs,vsi->vi", self.weights, values[self.nodes])


def interpolated_points(lattice: Lattice, touchable: np.ndarray) -> InterpolatedPoints:
    """Return the points halfway along the lattice's lines and amid its cells, if all their nodes are touchable."""
    rows, columns = lattice.shape
    halves = np.mgrid[: 2 * rows - 1, : 2 * columns - (not lattice.closed)].reshape(2, -1)
    between = halves[:, (halves % 2).any(axis=0)] / 2
    nodes, weights = (each.reshape(16, -1).T for each in stencil(lattice.shape, between, closed=lattice.closed))
    number = np.full(len(lattice.rest), -1)
    number[touchable] = np.arange(len(touchable))
    inside = (number[nodes] >= 0).all(axis=1)
    return InterpolatedPoints(number[nodes[inside]], weights[inside])


class SpringRows:
    """Compliance among nodes near an indenter and points between them: see ``ComplianceRows``.

    near : (n,) sorted numbers: of touchable nodes, and from their count on of points, whose nodes are all among them
    softness : m/N, of the springs, all alike
    """

    def __init__(self, compliance: Compliance, near: np.ndarray, points: InterpolatedPoints, softness: float) -> None:
        self.near, self.softness, self._count = near, softness, len(compliance.touchable)
        nodes, number = near[near < self._count], near[near >= self._count] - self._count
        self._rows = ComplianceRows(compliance, nodes)
        # What each number is a weighted sum of, as places in ``nodes``.
        self._nodes = np.concatenate([_alone(np.arange(len(nodes))), np.searchsorted(nodes, points.nodes[number])])
        self._weights = np.concatenate([_alone(np.ones(len(nodes))), points.weights[number]])

    def block(self, numbers: np.ndarray) -> np.ndarray:
        """Return the compliance (3 k, 3 k) float32 m/N among sorted, near numbers (k,), with their springs."""
        used, sums = self._sums(numbers)
        among = self._rows.block(used)
        block = np.empty((3 * len(numbers), 3 * len(numbers)), np.float32)
        for j in range(3):  # axis by axis: no more than a third is copied
            half = among[:, j::3] @ sums.T
            for i in range(3):
                block[i::3, j::3] = sums @ half[i::3]
        springs = np.repeat(numbers >= self._count, 3)
        block.reshape(-1)[:: len(block) + 1][springs] += self.softness
        return block

    def sensing_motion(self, numbers: np.ndarray, inner: np.ndarray) -> np.ndarray:
        """Return the motion (3 k, c) float32 m/N of sensing points (c,) under forces on numbers (k,)."""
        used, sums = self._sums(numbers)
        felt = self._rows.sensing_motion(used, inner)
        return (sums @ felt.reshape(len(used), -1)).reshape(3 * len(numbers), len(inner))

    def moved(self, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray) -> np.ndarray:
        """Return the surface's displacement (n, 3) m at the near numbers; forces as in ``NearRows.moved``."""
        moved = self._rows.moved(nodes, force, inner, inner_force)
        return np.einsum("ns,nsi->ni", self._weights, moved[self._nodes])

    def on_nodes(self, numbers: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return sorted nodes (j,) and their forces (j, 3) N, from forces (k, 3) N at sorted, single numbers (k,)."""
        at = np.searchsorted(self.near, numbers)
        loads = np.zeros((len(self._rows.near), 3))
        np.add.at(loads, self._nodes[at], self._weights[at][:, :, None] * force[:, None])
        carries = loads.any(axis=1)
        return self._rows.near[carries], loads[carries]

    def _sums(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sorted nodes (u,) that numbers (k,) depend on, and with which weights (k, u) float32."""
        at = np.searchsorted(self.near, numbers)
        sums = np.zeros((len(at), len(self._rows.near)), np.float32)
        np.add.at(sums, (np.arange(len(at))[:, None], self._nodes[at]), self._weights[at])
        used = np.flatnonzero(sums.any(axis=0))
        return self._rows.near[used], sums[:, used]


def _alone(values: np.ndarray) -> np.ndarray:
    """Values (n,) as the first of 16 columns, zeros after them."""
    columns = np.zeros((len(values), 16), values.dtype)
    columns[:, 0] = values
    return columns
