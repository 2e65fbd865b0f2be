"""Choose the nodes that enter a contact's solve, and find from a solved contact those that must be added."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...geometry.indenters import Indenter, Pose

# m, how far toward the second face of a concave crease its distance is measured: the least that finds it.
_CREASE_PROBES = (10e-6, 40e-6, 120e-6, 400e-6)
_MOST_LOOKS = 3  # for a node's second face: while it is still far from its place, only one may be seen (assumed)
_SAME_FACE = 0.97  # cosine between the normal that was seen and the one found there


@dataclasses.dataclass
class Candidates:
    """Nodes that may carry force, sorted; a node stands twice where it touches two faces of a concave crease.

    nodes : (k,) touchable indices; displacement : (k, 3) m, first guess; probe : (k, 3) m, see ``split``
    active : (k,) bool, first guess of which touch; inner : (c,) sensing points of the inner skin that may press
    looks : (k,) how often ``split`` looked for a node's faces; once a node stands twice they are known
    """

    nodes: np.ndarray
    displacement: np.ndarray
    probe: np.ndarray
    active: np.ndarray
    inner: np.ndarray
    looks: np.ndarray

    @property
    def faced(self) -> np.ndarray:
        """Mark (k,) bool the nodes that need no further check: doubled ones, or ``split`` found one face alone."""
        return self.looks >= _MOST_LOOKS

    def go_on(self, displacement: np.ndarray, active: np.ndarray) -> None:
        """Take an iterate as the new first guess; ``active`` may go on with that of the inner points."""
        self.displacement, self.active = displacement, active[: len(self.nodes)]

    def add(self, nodes: np.ndarray, displacement: np.ndarray, probe: np.ndarray) -> None:
        """Let more nodes enter, all of them touching at first."""
        self.looks = np.concatenate([self.looks, np.where(np.isin(nodes, self.nodes), _MOST_LOOKS, 0)])
        every = np.concatenate([self.nodes, nodes])
        order = np.argsort(every, kind="stable")
        self.nodes, self.looks = every[order], self.looks[order]
        self.displacement = np.concatenate([self.displacement, displacement])[order]
        self.probe = np.concatenate([self.probe, probe])[order]
        self.active = np.concatenate([self.active, np.ones(len(nodes), bool)])[order]

    def split(
        self, at: np.ndarray, left: np.ndarray, normals: np.ndarray, indenter: Indenter, pose: Pose, rest: np.ndarray
    ) -> None:
        """Let nodes ``at`` (j,) touch two faces, where there are two: the one that they are at and the one they left.

        left, normals : (j, 3), points of the faces that they left, and the normals there
        Where the planes of two faces meet, a little away from one of them the other is the nearer one: there its
        distance is measured.
        """
        self.looks[at] += 1
        points = rest[at] + self.displacement[at]
        gap, first = pose.distance(indenter, points)
        crease = _meet(points - gap[:, None] * first, first, left, normals)
        new, probe = np.zeros(len(at), bool), np.zeros_like(normals)
        for reach in _CREASE_PROBES:
            hit = ~new
            for face, other in ((normals, first), (first, normals)):
                _, found = pose.distance(indenter, crease + reach * other)
                hit &= np.einsum("ai,ai->a", found, face) > _SAME_FACE
            probe[hit], self.probe[at[hit]] = reach * first[hit], reach * normals[hit]
            new |= hit
        self.looks[at[new]] = _MOST_LOOKS
        self.displacement[at[new]] = (crease - rest[at])[new]
        self.add(self.nodes[at[new]], self.displacement[at[new]], probe[new])


def _meet(points: np.ndarray, first: np.ndarray, others: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The places (j, 3) nearest to points of planes with normals ``first`` that lie in other planes as well."""
    across = second - np.einsum("ai,ai->a", second, first)[:, None] * first
    way = np.einsum("ai,ai->a", others - points, second) / np.einsum("ai,ai->a", across, second)
    return points + way[:, None] * across
