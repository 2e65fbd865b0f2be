"""Entries of a sensor's large compliance among the nodes near an indenter, each gathered when it is first asked for."""

from __future__ import annotations

import numpy as np

from ...files.compiled import available
from .compliance import Compliance
from .mirror_symmetry import axes_of
from .surface_loops import gather_rows, surface_motion
from .surface_response import runs


class ComplianceRows:
    """Response of nodes near an indenter to forces on some of them. ``near`` (n,) are sorted touchable indices."""

    def __init__(self, compliance: Compliance, near: np.ndarray) -> None:
        self.compliance, self.near = compliance, near
        row, self._mirrored, image = compliance.answers
        self._row, self._mirrored = row[near], self._mirrored[near]
        at = compliance.touchable[near]
        self._columns, self._mirrored_columns = axes_of(at), axes_of(image[at])
        self._entries = np.empty((3 * len(near), 3 * len(near)), np.float32)
        self._entries_to_read = self._entries.view()  # a loop's argument is of one kind, and ``move`` is only read
        self._entries_to_read.flags.writeable = False
        self._known = np.zeros(len(near), bool)

    def block(self, nodes: np.ndarray) -> np.ndarray:
        """Return the compliance (3 k, 3 k) float32 m/N among sorted touchable nodes (k,), all of them near ones."""
        return self._rows(nodes).take(axes_of(np.searchsorted(self.near, nodes)), axis=1)

    def sensing_motion(self, nodes: np.ndarray, inner: np.ndarray) -> np.ndarray:
        """Return the motion (3 k, c) float32 m/N of sensing points (c,) under forces on touchable nodes (k,)."""
        return self.compliance.watch[axes_of(nodes)].take(inner, axis=1)

    def moved(self, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray) -> np.ndarray:
        """Return near nodes' displacements (n, 3) m by forces (k, 3) N at sorted ones, (c,) N at sensing points."""
        moved = self._under(nodes, force)
        if len(inner):
            moved += inner_force.astype(np.float32) @ self.compliance.inner_move[inner[:, None], self._columns]
        return moved.reshape(-1, 3).astype(float)

    def _under(self, nodes: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Near nodes' displacements (3 n,) float32, m, by forces (k, 3) N at sorted ones."""
        if not available():
            return force.ravel().astype(np.float32) @ self._rows(nodes)
        at, (_, _, image) = self._gather(nodes), self.compliance.answers
        none, no_force, inner_move = np.empty(0, int), np.empty(0), self.compliance.inner_move
        straight = np.zeros(len(at), bool)
        return surface_motion(self._entries_to_read, at, straight, image, force, inner_move, none, no_force)

    def _rows(self, nodes: np.ndarray) -> np.ndarray:
        """Rows (3 k, 3 n) of nodes (k,)."""
        return self._entries.take(axes_of(self._gather(nodes)), axis=0)

    def _gather(self, nodes: np.ndarray) -> np.ndarray:
        """Gather the entries of nodes (k,) that are not known yet; returns the places (k,) of all among the near."""
        at = np.searchsorted(self.near, nodes)
        new = at[~self._known[at]]
        if len(new):
            new = np.unique(new)  # a node may stand twice
            self._known[new] = True
            if available():
                gather_rows(
                    self.compliance.move, self._entries, new, self._row, self._mirrored, self._columns,
                    self._mirrored_columns,
                )  # fmt: skip
                return at
            mirrored = self._mirrored[new]
            direct, turned = new[~mirrored], new[mirrored]
            self._entries[axes_of(direct)] = self._gathered(self._row[direct], self._columns)
            turned = turned[np.argsort(self._row[turned], kind="stable")]
            answer = self._gathered(self._row[turned], self._mirrored_columns)
            answer[:, 2::3] *= -1
            answer[2::3] *= -1
            self._entries[axes_of(turned)] = answer
        return at

    def _gathered(self, row: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Entries (3 k, j) of three rows of the large matrix for each of sorted ``row`` (k,), in ``columns`` (j,)."""
        answer = np.empty((3 * len(row), len(columns)), np.float32)
        for start, stop, first, last in runs(row) if len(row) else ():
            rows = self.compliance.move[3 * first : 3 * last]
            rows.take(columns, axis=1, out=answer[3 * start : 3 * stop], mode="clip")
        return answer
