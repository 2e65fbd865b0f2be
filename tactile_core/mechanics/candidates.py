"""Which nodes enter a contact's solve, and how a solved contact shows that others must."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..indenters import Indenter, Pose

# m, how far toward the second face of a concave crease its distance is measured: the least that finds it.
_CREASE_PROBES = (10e-6, 40e-6, 120e-6, 400e-6)
_SAME_FACE = 0.9  # cosine between the normal that was seen and the one found there


@dataclasses.dataclass
class Candidates:
    """Nodes that may carry force, sorted; a node stands twice where it touches two faces of a concave crease.

    nodes : (k,) touchable indices; displacement : (k, 3) m, first guess; probe : (k, 3) m, see ``split``
    active : (k,) bool, first guess of which touch; inner : (c,) watched points of the inner skin that may press
    faced : (k,) bool, nodes whose faces are known: they stand twice, or ``split`` found only one
    """

    nodes: np.ndarray
    displacement: np.ndarray
    probe: np.ndarray
    active: np.ndarray
    inner: np.ndarray
    faced: np.ndarray

    def go_on(self, displacement: np.ndarray, active: np.ndarray) -> None:
        """Take an iterate as the new first guess; ``active`` may go on with that of the inner points."""
        self.displacement, self.active = displacement, active[: len(self.nodes)]

    def add(self, nodes: np.ndarray, displacement: np.ndarray, probe: np.ndarray) -> None:
        """Let more nodes enter, all of them touching at first."""
        self.faced = np.concatenate([self.faced, np.isin(nodes, self.nodes)])
        every = np.concatenate([self.nodes, nodes])
        order = np.argsort(every, kind="stable")
        self.nodes, self.faced = every[order], self.faced[order]
        self.displacement = np.concatenate([self.displacement, displacement])[order]
        self.probe = np.concatenate([self.probe, probe])[order]
        self.active = np.concatenate([self.active, np.ones(len(nodes), bool)])[order]

    def split(self, at: np.ndarray, normals: np.ndarray, indenter: Indenter, pose: Pose, rest: np.ndarray) -> None:
        """Let nodes ``at`` (j,) touch a second face with ``normals`` (j, 3) too, where there is one.

        A little toward a face it is the nearer one: there its distance is measured, for both of them.
        """
        self.faced[at] = True
        gap, first = pose.distance(indenter, rest[at] + self.displacement[at])
        points = rest[at] + self.displacement[at] - np.minimum(gap, 0)[:, None] * first
        new, probe = np.zeros(len(at), bool), np.zeros_like(normals)
        for reach in _CREASE_PROBES:
            hit = ~new
            for face in (normals, first):
                _, found = pose.distance(indenter, points - reach * face)
                hit &= np.einsum("ai,ai->a", found, face) > _SAME_FACE
            probe[hit], self.probe[at[hit]] = -reach * normals[hit], -reach * first[hit]
            new |= hit
        self.add(self.nodes[at[new]], self.displacement[at[new]], probe[new])
