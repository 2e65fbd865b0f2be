"""Sparsity pattern of a stiffness matrix in 3 x 3 blocks: computed once per mesh, filled in every iteration."""

from __future__ import annotations

import functools

import numpy as np


class BlockPattern:
    """Sums cell matrices into one block per pair of neighbouring nodes, and makes sparse matrices of the blocks.

    rows, columns : (n_blocks,), the two nodes of each block; diagonal : (n_nodes,), each node's block with itself"""

    def __init__(self, cells: np.ndarray, clamped: np.ndarray) -> None:
        """Take the nodes of cells (n_cells, k), all nodes among them; clamped : (n,) bool, nodes that never move"""
        self.n_nodes = n_nodes = len(clamped)
        self.free = np.flatnonzero(np.repeat(~clamped, 3))  # degrees of freedom that ``upper`` has rows for
        pairs = cells[:, :, None].astype(np.int64) * n_nodes + cells[:, None, :]
        places, slots = np.unique(pairs.ravel(), return_inverse=True)
        self.slots = slots.ravel().astype(np.int32)  # of (n_cells, k, k)
        self._places = places
        self.rows, self.columns = (places // n_nodes).astype(np.int32), (places % n_nodes).astype(np.int32)
        self.diagonal = np.flatnonzero(self.rows == self.columns)
        self.starts = np.searchsorted(self.rows, np.arange(n_nodes + 1)).astype(np.int32)

    def gather(self, stiffness: np.ndarray) -> np.ndarray:
        """Add up cells' stiffness (n_cells, k, 3, 3, k), (node, axis, axis, node), in blocks (n_blocks, 3, 3)."""
        blocks = np.empty((len(self.rows), 3, 3))
        for i in range(3):
            for j in range(3):
                values = np.ascontiguousarray(stiffness[:, :, i, j, :]).ravel()
                blocks[:, i, j] = np.bincount(self.slots, values, minlength=len(self.rows))
        return blocks

    def find(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the indices (p,) into ``blocks`` of pairs of nodes rows, columns (p,) that share a cell."""
        return np.searchsorted(self._places, rows.astype(np.int64) * self.n_nodes + columns)

    def turn(self, blocks: np.ndarray, nodes: np.ndarray, frames: np.ndarray) -> None:
        """Turn the rows and columns of ``nodes`` (k,) in blocks (n_blocks, 3, 3), in place, to these nodes' own axes:
        the columns of frames (k, 3, 3)."""
        index = np.full(self.n_nodes, -1)
        index[nodes] = np.arange(len(nodes))
        for side, of in ((0, self.rows), (1, self.columns)):
            here = np.flatnonzero(index[of] >= 0)
            frame = frames[index[of[here]]]
            blocks[here] = blocks[here] @ frame if side else frame.swapaxes(1, 2) @ blocks[here]

    def sparse(self, blocks: np.ndarray):  # noqa: ANN201 (scipy is imported only where it is needed)
        """Assemble the matrix (3 n, 3 n), scipy BSR, of blocks (n_blocks, 3, 3)."""
        import scipy.sparse

        size = 3 * self.n_nodes
        return scipy.sparse.bsr_matrix((blocks, self.columns, self.starts), shape=(size, size))

    @functools.cached_property
    def _upper(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, columns and places in ``blocks`` of the free entries on and above the diagonal; rows' starts."""
        place = np.full(3 * self.n_nodes, -1, np.int32)
        place[self.free] = np.arange(len(self.free))
        axis, shape = np.arange(3), (len(self.rows), 3, 3)
        rows = np.broadcast_to(place[3 * self.rows[:, None, None] + axis[:, None]], shape).ravel()
        columns = np.broadcast_to(place[3 * self.columns[:, None, None] + axis], shape).ravel()
        keep = np.flatnonzero((columns >= rows) & (rows >= 0))
        keep = keep[np.argsort(rows[keep].astype(np.int64) * len(self.free) + columns[keep])]
        starts = np.searchsorted(rows[keep], np.arange(len(self.free) + 1)).astype(np.int32)
        return rows[keep], columns[keep], keep, starts

    def upper(self, blocks: np.ndarray, held: np.ndarray):  # noqa: ANN201
        """Return the matrix's upper triangle among unclamped degrees of freedom, scipy CSR, with identity rows for held
        ones.
        blocks : (n_blocks, 3, 3); held : (n_free,) bool. The pattern is the same every time: a solver may keep its
            analysis."""
        import scipy.sparse

        rows, columns, places, starts = self._upper
        data = blocks.ravel()[places]
        data[held[rows] | held[columns]] = 0.0
        data[starts[:-1][held]] = 1.0  # the diagonal comes first in its row
        return scipy.sparse.csr_matrix((data, columns, starts), shape=(len(held), len(held)))
