"""Penalty points, which keep a sharp indenter from penetrating between a surface's nodes.

Nodes touch exactly (``contact_set``), but without friction they slide off edges, which then cut in between them. If a
contact lets the indenter through, or is not found, points halfway between nodes push back, each by a stiff spring
(penalty method: P. Wriggers, Computational Contact Mechanics, 2006, chapter 6). Other contacts use nodes alone.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..penetration import SLACK
from ..solids.block_pattern import BlockPattern
from ..solids.elasticity import quadratic
from .contact_set import Obstacle

# m: at the edges of nine contacts with balls of 7 and 14 mm quadratic faces hid up to 43 um, and 129 um once.
LET_THROUGH = 50e-6
# m: the turn of normals is accounted for at points up to this deep; deeper ones are still moving out (assumed).
_NEAR = 100e-6


def _weights() -> np.ndarray:
    """Return weights (16, 9) of a face's 9 nodes for each of the 16 points halfway between them."""
    line, _ = quadratic(np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    every = np.einsum("ib,ja->ijba", line, line).reshape(25, 9)
    return every[every.max(axis=1) < 1]


_WEIGHTS = _weights()


@dataclasses.dataclass(frozen=True)
class Push:
    """Forces of an obstacle on the k penalty points that it has reached.
    nodes : (k, 9) int, of the mesh, and weights : (k, 9); each point is the weighted mean of its nodes
    force : (k, 3) N, on the points; stiffness : (k, 3, 3) N/m, minus the force's derivative by the point's place"""

    nodes: np.ndarray
    weights: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Total force (3,) N."""
        return self.force.sum(axis=0)

    def loads(self, n: int) -> np.ndarray:
        """Return the loads (n, 3) N on a mesh's n nodes that the points' forces make, shared out by the weights."""
        loads = np.zeros((n, 3))
        np.add.at(loads, self.nodes, self.weights[:, :, None] * self.force[:, None])
        return loads

    def add_to(self, residual: np.ndarray, blocks: np.ndarray, pattern: BlockPattern) -> None:
        """Subtract the loads from residual (n, 3) N (internal minus outer forces), and add the points' stiffness to the
        matrix's blocks (n_blocks, 3, 3) N/m, in the order of ``pattern``; both in place."""
        residual -= self.loads(len(residual))
        pairs = (self.weights[:, :, None] * self.weights[:, None])[..., None, None] * self.stiffness[:, None, None]
        rows, columns = np.repeat(self.nodes, 9, axis=1), np.tile(self.nodes, 9)
        np.add.at(blocks, pattern.find(rows.ravel(), columns.ravel()), pairs.reshape(-1, 3, 3))


class PenaltyPoints:
    """Points at which springs keep an obstacle out between nodes of quadratic faces (f, 9): 16 per face, halfway.

    Node 3 b + a of a face is at (xi, eta) = (a, b) - 1."""

    def __init__(self, faces: np.ndarray) -> None:
        self._nodes, self._weights = np.repeat(faces, len(_WEIGHTS), axis=0), np.tile(_WEIGHTS, (len(faces), 1))

    def deepest(self, obstacle: Obstacle, at: np.ndarray) -> float:
        """Return the penetration, m, of the deepest point into an obstacle; at : (n, 3) m, the mesh's nodes"""
        return max(-float(obstacle.distance(self._points(at))[0].min(initial=0.0)), 0.0)

    def _points(self, at: np.ndarray) -> np.ndarray:
        return np.einsum("pa,pai->pi", self._weights, at[self._nodes])

    def push(self, obstacle: Obstacle, at: np.ndarray, stiffness: float) -> Push:
        """Return the push of an obstacle on the points more than 20 um inside it.

        at : (n, 3) m, the mesh's nodes now; stiffness : N/m, of each point's spring"""
        points = self._points(at)
        distance, normal = obstacle.distance(points)
        inside = np.flatnonzero(distance < -SLACK)
        distance, normal = distance[inside], normal[inside]
        pull = -stiffness * (distance + SLACK)
        tangent = stiffness * normal[:, :, None] * normal[:, None]
        near = distance > -_NEAR
        tangent[near] -= pull[near, None, None] * obstacle.curvature(points[inside[near]])
        return Push(self._nodes[inside], self._weights[inside], pull[:, None] * normal, tangent)


NO_PUSH = Push(np.zeros((0, 9), int), np.zeros((0, 9)), np.zeros((0, 3)), np.zeros((0, 3, 3)))
