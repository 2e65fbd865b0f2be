"""Parts of a sensor's compliance among the nodes near an indenter, and the motion that forces on these cause."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ...files.compiled import Loop, add_scaled
from .compliance import Compliance
from .condense import axes_of

# Relative stiffness added to each node: 1e-6 moves a gap by nanometres and keeps single precision definite, also where
# one node presses two faces of a concave corner.
RIDGE = 1e-6
_INNER = 2**40  # more than a surface has degrees of freedom


class Rows(Protocol):
    """Compliance among points near an indenter: nodes, by position in ``touchable``, and perhaps points between."""

    near: np.ndarray  # sorted indices (n,): a touchable node's, or their count plus that of a point between

    def block(self, numbers: np.ndarray) -> np.ndarray:
        """Return the compliance (3 k, 3 k) float32 m/N among the points ``numbers`` (k,), sorted, some of ``near``."""

    def sensing_motion(self, numbers: np.ndarray, inner: np.ndarray) -> np.ndarray:
        """Return the motion (3 k, c) float32 m/N of sensing points ``inner`` (c,), by position among all of them, under
        1 N on each axis of the points ``numbers`` (k,), sorted, some of ``near``."""

    def moved(self, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray) -> np.ndarray:
        """Return the displacements (n, 3) m of all points ``near`` under force (k, 3) N at sorted nodes (k,) and
        inner_force (c,) N at sensing points ``inner`` (c,)."""


class ComplianceRows:
    """Compliance among nodes near an indenter, read when asked for. near : (n,) positions in ``touchable``, sorted"""

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
        """Return the compliance (3 k, 3 k) float32 m/N among nodes (k,), sorted, some of ``near``."""
        at = axes_of(self._gather(nodes))
        return self._entries.take(at, axis=0).take(at, axis=1)

    def sensing_motion(self, nodes: np.ndarray, inner: np.ndarray) -> np.ndarray:
        """Return the motion (3 k, c) m/N of the sensing points of indices ``inner`` (c,) under 1 N on each axis of
        nodes (k,)."""
        return self.compliance.watch[axes_of(nodes)].take(inner, axis=1)

    def moved(self, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray) -> np.ndarray:
        """Return the displacements (n, 3) m of ``near``; arguments: see `Rows.moved`."""
        at, (_, _, image), inner_move = self._gather(nodes), self.compliance.answers, self.compliance.inner_move
        straight, none, no_force = np.zeros(len(at), bool), np.empty(0, int), np.empty(0)
        moved = _sum_motion(self._entries_to_read, at, straight, image, force, inner_move, none, no_force)
        if len(inner):
            moved += inner_force.astype(np.float32) @ inner_move[inner[:, None], self._columns]
        return moved.reshape(-1, 3).astype(float)

    def _gather(self, nodes: np.ndarray) -> np.ndarray:
        """Read the rows of nodes (k,) that are not known yet; return the positions (k,) of all of them in ``near``."""
        at = np.searchsorted(self.near, nodes)
        new = at[~self._known[at]]
        if len(new):
            new = np.unique(new)  # a node may stand twice
            self._known[new] = True
            _gather_rows(
                self.compliance.move, self._entries, new, self._row, self._mirrored, self._columns,
                self._mirrored_columns,
            )  # fmt: skip
        return at


class ComplianceBlock:
    """Compliance of k surface nodes (three axes) and c points of the inner skin that may press on the core.

    nodes : (k,) sorted, some of ``rows.near``; a node stands twice if it touches two faces of the indenter
    inner : (c,) sorted indices of sensing points
    rows : compliance among all nodes near the indenter
    matrix : (3 k + c, 3 k + c) float32, m/N: x, y, z of each node in turn, then the inner points' motion off the core
    """

    def __init__(self, compliance: Compliance, nodes: np.ndarray, inner: np.ndarray, rows: Rows) -> None:
        self.nodes, self.inner = nodes, inner
        self.k, self.c = len(nodes), len(inner)
        self.keys = np.concatenate([axes_of(nodes), _INNER + inner])  # (3 k + c,), sorted: the same in every block
        size = 3 * self.k
        surface = rows.block(nodes)
        self.matrix = surface if not self.c else np.empty((size + self.c, size + self.c), np.float32)
        if self.c:
            self.matrix[:size, :size] = surface
            self.matrix[:size, size:] = rows.sensing_motion(nodes, inner)
            self.matrix[size:, :size] = self.matrix[:size, size:].T
            self.matrix[size:, size:] = compliance.inner_watch[np.ix_(inner, inner)]

    def respond(self, force: np.ndarray, pressing_core: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the displacement (k, 3) m of the nodes and the motion (c,) m of inner points off the core, by force
        (k, 3) N on the nodes and pressing_core (c,) N on the points."""
        answer = np.concatenate([force.ravel(), pressing_core]).astype(np.float32) @ self.matrix
        return answer[: 3 * self.k].reshape(self.k, 3).astype(float), answer[3 * self.k :].astype(float)

    def normal(self, normals: np.ndarray) -> np.ndarray:
        """Return the compliance (k + c, k + c) m/N of the gaps: k along ``normals`` (k, 3), then c over the core."""
        return _normal_compliance(self.matrix, np.ascontiguousarray(normals), self.c, RIDGE)

    def turned(self, matrix: np.ndarray, normals: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Return a copy of ``matrix`` (k + c, k + c), made by ``normal``, updated for normals that have turned.
        normals : (k, 3), all as they are now; at : (j,), positions among the block's nodes of those that turned"""
        k, size = self.k, 3 * self.k
        rows = self.matrix.take(axes_of(at), axis=0)
        strips = _contract(rows[:, :size], normals[at].astype(np.float32), normals.astype(np.float32)).astype(float)
        strips[np.arange(len(at)), at] *= 1 + RIDGE
        matrix = matrix.copy()
        matrix[at, :k], matrix[:k, at] = strips, strips.T
        if self.c:
            side = np.einsum("aic,ai->ac", rows[:, size:].reshape(len(at), 3, self.c), normals[at])
            matrix[at, k:], matrix[k:, at] = side, side.T
        return matrix


def _contract(block: np.ndarray, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the sum over i, j of source[a, i] block[a i, b j] target[b, j]; by strides, faster than einsum here."""
    half = block[:, 0::3] * target[:, 0]
    half += block[:, 1::3] * target[:, 1]
    half += block[:, 2::3] * target[:, 2]
    half = half.reshape(len(source), 3, len(target))
    return half[:, 0] * source[:, :1] + half[:, 1] * source[:, 1:2] + half[:, 2] * source[:, 2:]


def surface_motion(
    compliance: Compliance, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray
) -> np.ndarray:
    """Return the displacement (n, 3) float32 m of the surface under force (k, 3) N at nodes (k,), sorted positions in
    ``touchable``, and inner_force (c,) N at sensing points ``inner`` (c,)."""
    rows, mirror, image = compliance.answers
    row, mirrored = rows[nodes], mirror[nodes]
    moved = _sum_motion(compliance.move, row, mirrored, image, force, compliance.inner_move, inner, inner_force)
    return moved.reshape(-1, 3)


def sensing_gaps(
    compliance: Compliance, nodes: np.ndarray, force: np.ndarray, inner: np.ndarray, inner_force: np.ndarray, count: int
) -> np.ndarray:
    """Return the gaps (count,) m, to electrode or core, of the first ``count`` sensing points under force (k, 3) N at
    sorted nodes (k,) and inner_force (c,) N at sensing points ``inner`` (c,)."""
    gaps = compliance.watch_gap[:count].astype(float)
    if not len(gaps):
        return gaps
    for start, stop, first, last in _runs(nodes) if len(nodes) else ():
        gaps = gaps + force[start:stop].ravel().astype(np.float32) @ compliance.watch[3 * first : 3 * last, :count]
    if len(inner):
        gaps = gaps + inner_force.astype(np.float32) @ compliance.inner_watch[inner, :count]
    return gaps


def _runs(indices: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Return stretches of consecutive values in sorted ``indices``: start, stop there, first value, last plus 1."""
    cuts = np.flatnonzero(np.diff(indices) != 1) + 1
    starts, stops = np.r_[0, cuts], np.r_[cuts, len(indices)]
    return list(
        zip(starts.tolist(), stops.tolist(), indices[starts].tolist(), (indices[stops - 1] + 1).tolist(), strict=True)
    )


@Loop
def _gather_rows(move, entries, at, rows, mirrored, columns, mirrored_columns):  # noqa: ANN001, ANN202
    """Fill in the rows (3 n) of ``entries`` (3 n, 3 n) m/N that belong to near nodes ``at`` (k,).
    move : (3 r, j) float32 m/N, of ``Compliance``; rows : (n,), number in it of the node that answers for each near one
    mirrored : (n,) bool, true if the near node is that one's mirror image
    columns, mirrored_columns : (3 n,), columns of ``move`` of the near nodes, and of their mirror images
    """
    for each in at:
        flip = mirrored[each]
        for axis in range(3):
            source, out = move[3 * rows[each] + axis], entries[3 * each + axis]
            for j in range(len(columns)):
                if flip:  # mirrored in z: the force, and the motion
                    value = source[mirrored_columns[j]]
                    out[j] = value if (axis == 2) == (j % 3 == 2) else -value
                else:
                    out[j] = source[columns[j]]


@Loop
def _sum_motion(move, rows, mirrored, image, force, inner_move, inner, inner_force):  # noqa: ANN001, ANN202
    """Return the displacement (3 n,) float32, m, of the whole surface; other arguments as in ``surface_motion``.
    rows : (k,), number in ``move`` of the node that answers for each; mirrored : (k,) bool, true if as its mirror image
    image : (n,), index of each surface node's mirror image
    """
    size = move.shape[1]
    moved, there = np.zeros(size, np.float32), np.zeros(size, np.float32)
    any_there = False
    for a in range(len(rows)):
        flip = mirrored[a]
        any_there |= flip
        out = there if flip else moved
        x, y = np.float32(force[a, 0]), np.float32(force[a, 1])
        z = np.float32(-force[a, 2] if flip else force[a, 2])
        first, second, third = move[3 * rows[a]], move[3 * rows[a] + 1], move[3 * rows[a] + 2]
        for j in range(size):  # not arrays as a whole: the first such expression costs numba seconds
            out[j] += x * first[j] + y * second[j] + z * third[j]
    for p in range(len(inner)):
        line, load = inner_move[inner[p]], np.float32(inner_force[p])
        add_scaled(moved, load, line)
    for j in range(size // 3 if any_there else 0):
        moved[3 * j] += there[3 * image[j]]
        moved[3 * j + 1] += there[3 * image[j] + 1]
        moved[3 * j + 2] -= there[3 * image[j] + 2]
    return moved


@Loop
def _normal_compliance(matrix, normal, c, ridge):  # noqa: ANN001, ANN202
    """Compute ``ComplianceBlock.normal``; matrix, c : the block's; ridge : relative increase of the diagonal"""
    k = len(normal)
    size, gaps = 3 * k, np.empty((k + c, k + c))
    for a in range(k):
        x, y, z = normal[a, 0], normal[a, 1], normal[a, 2]
        first, second, third = matrix[3 * a], matrix[3 * a + 1], matrix[3 * a + 2]
        half = x * first + y * second + z * third
        gaps[a, :k] = half[0:size:3] * normal[:, 0] + half[1:size:3] * normal[:, 1] + half[2:size:3] * normal[:, 2]
        gaps[a, k:] = half[size:]
        gaps[k:, a] = half[size:]
    gaps[k:, k:] = matrix[size:, size:]
    for a in range(k + c):
        gaps[a, a] *= 1 + ridge
    return gaps
