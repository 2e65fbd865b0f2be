"""Condense a solid to its surface: eliminate all other unknowns, cell group by cell group (multifrontal method).

The solid is symmetric in z, so its even and its odd motion are two problems of half the unknowns. The groups of cells
form a tree; an inner unknown is eliminated once the last cell that holds it has joined (I. Duff, J. Reid, ACM Trans.
Math. Software 9, 1983, 302-325). Nearly all work is products of large dense matrices.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from ...sensors import Material
from ..solids.elasticity import cell_stiffness
from ..solids.hex_mesh import HexMesh

if TYPE_CHECKING:
    from scipy.sparse import csc_array

_LEAF = 8  # cells per group: smaller groups cost calls, larger ones dense work on zeros
_BLOCK = 64  # rows mirrored at a time
_SAME_PLACE = 1e-8  # m, between a node and the mirror image of its partner
_MIRROR = np.array([1.0, 1.0, -1.0])


@dataclasses.dataclass(frozen=True)
class Half:
    """The even (or odd) motion of a solid, given at the k nodes with z >= 0 that are kept, r of which are touched.

    answer : (3 r, 3 k) m/N, motion of the kept nodes under unit forces on touched ones; 0 along axes that cannot move
    under_loads : (3 k, w), their motion under w unit loads; among : (w, w), work of each load on another's motion"""

    answer: np.ndarray
    under_loads: np.ndarray
    among: np.ndarray


def mirror_nodes(nodes: np.ndarray) -> np.ndarray:
    """Return each node's image under z to -z, (n,), of nodes (n, 3) m. Raises ValueError if one has none."""
    from scipy.spatial import cKDTree

    away, image = cKDTree(nodes).query(nodes * _MIRROR)
    if away.max() > _SAME_PLACE:
        raise ValueError("the solid is not mirror symmetric: some nodes have no image")
    return image


def condense(
    mesh: HexMesh, material: Material, keep: np.ndarray, touched: np.ndarray, loads: csc_array, parity: int
) -> Half:
    """Condense the even (``parity`` 1) or odd (-1) half of a solid to the nodes ``keep`` (k,) with z >= 0.
    touched : (r,) sorted positions, in ``keep``, of the nodes that forces act on
    loads : (3 n_nodes, w) sparse, unit loads on any nodes, one a column
    Raises ValueError for a solid that is not mirror symmetric in z, or is held nowhere."""
    tree = _Elimination(mesh, material, keep, loads, parity)
    dofs, stiffness = tree.group(np.arange(len(tree.cells)))
    from scipy.linalg import lapack

    factor, failed = lapack.dpotrf(stiffness.T, lower=1, overwrite_a=1)  # in place: LAPACK counts by columns
    del stiffness
    if failed:
        raise ValueError("the stiffness is singular: is the solid held anywhere?")
    inverse, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
    mirror_upper(inverse.T)
    place = np.full(tree.free, -1)
    place[dofs] = np.arange(len(dofs))
    held = tree.number[(3 * keep[:, None] + np.arange(3)).ravel()]
    known = held >= 0
    rows = place[held[known]]
    pressed = axes_of(touched)
    pushed = known[pressed]
    answer = np.zeros((len(pressed), len(held)), np.float32)
    for row in np.flatnonzero(pushed):  # all at once would take 170 MB more
        answer[row, known] = inverse[place[held[pressed[row]]], rows]
    load = tree.loads[dofs]
    moved = inverse @ load
    under_loads = np.zeros((len(held), loads.shape[1]))
    under_loads[known] = moved[rows]
    return Half(answer, under_loads, tree.among + load.T @ moved)


def mirror_upper(matrix: np.ndarray) -> None:
    """Copy the upper triangle of a square matrix, which has zeros below it, to the lower one, in place."""
    for start in range(0, len(matrix), _BLOCK):
        part = slice(start, min(start + _BLOCK, len(matrix)))
        square = matrix[part, part]
        square += np.triu(square, 1).T
        matrix[part.stop :, part] = matrix[part, part.stop :].T


class _Elimination:
    """Condenses half a solid to nodes ``keep`` (k,). loads : (3 n, w), unit; parity : 1 even half, -1 odd half"""

    def __init__(self, mesh: HexMesh, material: Material, keep: np.ndarray, loads: csc_array, parity: int) -> None:
        from scipy import sparse

        # Unknowns: axes of nodes with z >= 0 ("speaks"). ``dof``, ``sign`` (3 n,) give for each node's axis the unknown
        # that its motion is, times the sign; -1 where it cannot move.
        image = mirror_nodes(mesh.nodes)
        z = mesh.nodes[:, 2]
        plane = image == np.arange(len(z))
        speaks = (z >= 0) | plane
        stands = np.where(speaks, np.arange(len(z)), image)
        sign = np.where(speaks[:, None], 1.0, parity * _MIRROR)
        moves = (speaks & ~mesh.clamped)[:, None] & ~(plane[:, None] & (parity * _MIRROR < 0))
        self.number = np.where(moves, np.cumsum(moves.ravel()).reshape(moves.shape) - 1, -1).ravel()
        self.free = int(moves.sum())
        own = (3 * stands[:, None] + np.arange(3)).ravel()
        self.dof, self.sign = self.number[own], sign.ravel()
        known = np.flatnonzero(self.dof >= 0)
        fold = sparse.csr_array((self.sign[known], (self.dof[known], known)), shape=(self.free, len(self.dof)))
        self.loads = (fold @ loads).toarray()
        self.among = np.zeros((loads.shape[1],) * 2)
        middle = mesh.nodes[mesh.cells].mean(axis=1)
        chosen = middle[:, 2] > -1e-9
        self.cells, self.middle = mesh.cells[chosen], middle[chosen]
        twice = np.where(self.middle[:, 2] > 1e-9, 2.0, 1.0)  # a cell and its image, or one that is its own
        self.stiffness = cell_stiffness(mesh.nodes[self.cells], material) * twice[:, None, None]
        self.kept = np.zeros(self.free, bool)
        held = self.number[(3 * keep[:, None] + np.arange(3)).ravel()]
        self.kept[held[held >= 0]] = True
        self.uses = np.zeros(self.free, int)
        for cell in self.cells:
            self.uses[np.unique(self._cell_dofs(cell)[0])] += 1

    def _cell_dofs(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        full = (3 * cell[:, None] + np.arange(3)).ravel()
        local = np.flatnonzero(self.dof[full] >= 0)
        return self.dof[full[local]], self.sign[full[local]], local

    def group(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the unknowns (n,) of a group of ``cells`` that other cells share or that are kept, and the stiffness
        (n, n) N/m that the group has among them."""
        if len(cells) <= _LEAF:
            parts = []
            for c in cells:
                dofs, sign, local = self._cell_dofs(self.cells[c])
                single, inverse = np.unique(dofs, return_inverse=True)
                fold = np.zeros((len(dofs), len(single)))
                fold[np.arange(len(dofs)), inverse] = sign
                parts.append((single, fold.T @ self.stiffness[c][np.ix_(local, local)] @ fold))
        else:
            middle = self.middle[cells]
            order = cells[np.argsort(middle[:, np.argmax(np.ptp(middle, axis=0))], kind="stable")]
            parts = [self.group(order[: len(order) // 2]), self.group(order[len(order) // 2 :])]
        return self._eliminate(cells, parts)

    def _eliminate(self, cells: np.ndarray, parts: list) -> tuple[np.ndarray, np.ndarray]:
        """Add up the parts of a group of ``cells`` and eliminate the unknowns that belong to no other cell (Schur
        complement); return what ``group`` does."""
        from scipy.linalg import lapack, solve_triangular

        uses = np.zeros(self.free, int)
        for c in cells:
            uses[np.unique(self._cell_dofs(self.cells[c])[0])] += 1
        dofs = np.unique(np.concatenate([part[0] for part in parts]))
        inside = (uses[dofs] == self.uses[dofs]) & ~self.kept[dofs]
        dofs = np.concatenate([dofs[inside], dofs[~inside]])
        place = np.empty(self.free, int)
        place[dofs] = np.arange(len(dofs))
        front = np.zeros((len(dofs), len(dofs)))
        while parts:  # each is freed once it is added
            _add(front, place, *parts.pop(0))
        n = int(inside.sum())
        if n == 0:
            return dofs, front
        factor, failed = lapack.dpotrf(front[:n, :n], lower=1)
        if failed:
            raise ValueError("a cell's stiffness is not positive definite")
        carried = solve_triangular(factor, front[:n, n:], lower=True, check_finite=False)
        rest = carried.T @ carried
        np.subtract(front[n:, n:], rest, out=rest)
        if self.loads.shape[1]:
            load = solve_triangular(factor, self.loads[dofs[:n]], lower=True, check_finite=False)
            self.loads[dofs[n:]] -= carried.T @ load
            self.among += load.T @ load
        return dofs[n:], rest


def _add(front: np.ndarray, place: np.ndarray, own: np.ndarray, stiffness: np.ndarray) -> None:
    at = place[own]
    for row, values in zip(at, stiffness, strict=True):  # all at once would hold two copies more
        front[row, at] += values


def axes_of(nodes: np.ndarray) -> np.ndarray:
    """Return the indices (3 k,) of the degrees of freedom of nodes (k,): 3 i, 3 i + 1, 3 i + 2."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


class MirrorSymmetry:
    """Joins a motion's even and odd half. half : (k,) surface nodes, z >= 0; image : (n,) mirror image of each node"""

    def __init__(self, half: np.ndarray, image: np.ndarray) -> None:
        count = 3 * len(half)
        self._sign = np.tile([1.0, 1.0, -1.0], len(half)).astype(np.float32)
        self._place = np.empty(3 * len(image), int)  # in a half and, behind it, its mirror image
        self._place[axes_of(image[half])] = np.arange(count, 2 * count)
        self._place[axes_of(half)] = np.arange(count)  # after the other: on the mirror plane this one is right

    def loads(self, even: np.ndarray, odd: np.ndarray, column: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """Return motions (w, 3 n) float32 of all surface nodes from their halves even, odd (3 k, v) under v loads: the
        i-th is under load ``column[i]``, or under its mirror image if ``sign[i]`` is -1. column, sign : (w,)"""
        return self._joined(even.T, odd.T, column, sign.astype(np.float32))

    def forces(self, even: np.ndarray, odd: np.ndarray) -> np.ndarray:
        """Return the motion (3 r, 3 n) float32 of all n nodes, a row for 1 N along each axis of the r touched ones,
        from ``Half.answer`` of both halves: even, odd (3 r, 3 k)."""
        return self._joined(even, odd, np.arange(len(even)), np.ones(len(even), np.float32))

    def _joined(self, even: np.ndarray, odd: np.ndarray, rows: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """Return motions (w, 3 n) from ``rows`` (w,) of even, odd: even + sign odd at z >= 0, below even - sign odd."""
        both = np.empty((2, len(self._sign)), np.float32)
        joined = np.empty((len(rows), len(self._place)), np.float32)
        for motion, row, mirrored in zip(joined, rows, sign, strict=True):
            here = mirrored * odd[row]
            np.add(even[row], here, out=both[0])
            np.multiply(even[row] - here, self._sign, out=both[1])
            both.take(self._place, out=motion, mode="clip")  # "raise" would buffer it
        return joined
