"""A thin sheet of conducting fluid with round electrodes: resistances from div(sigma h grad phi) = 0 on a surface.

Linear triangles. An electrode injects its current evenly over its disc and reads the mean potential there, which stays
exact as the grid gets finer and needs no nodes on the disc's rim. All other electrodes float.
"""

from __future__ import annotations

import numpy as np

_DISC_SAMPLES = 16  # parts of a triangle's edge, 0.03 mm each, to measure what share of it an electrode covers


class ThinSheet:
    """A conducting sheet on a triangulated surface, whose thickness is given anew for each solve.
    nodes : (n, 3) m; faces : (m, 3) int, triangles, one connected piece
    centers : (k, 3) m, and radius : m, of the round electrodes
    refine : how often each triangle is cut into four; films are still given at the original n nodes"""

    def __init__(
        self, nodes: np.ndarray, faces: np.ndarray, centers: np.ndarray, radius: float, refine: int = 0
    ) -> None:
        import scipy.sparse

        self.given = nodes, faces, centers, radius
        self.prolong = scipy.sparse.identity(len(nodes), format="csr")
        for _ in range(refine):
            nodes, faces, finer = _halved(nodes, faces)
            self.prolong = finer @ self.prolong
        self.nodes, self.faces = nodes, faces
        corners = nodes[faces]
        size = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)  # of the longest edge, m
        self.patches = np.stack([_disc(nodes, faces, size, center, radius) for center in centers], 1)
        self._prepare_matrix()

    def potentials(self, film: np.ndarray, conductivity: float = 1.0) -> np.ndarray:
        """Return the mean potential (k, k) V of electrode i for 1 A into electrode j, up to a constant per column.
        film : (n,) m, thickness at the nodes; conductivity : S/m. Raises ValueError unless the film is positive.
        Each current leaves at the first node, at 0 V: only sums of columns whose currents cancel have a meaning."""
        from ..solids.sparse_cholesky import factor

        answer = factor(self.matrix(film, conductivity)[1:, 1:].tocsc())(self.patches[1:])
        return self.patches[1:].T @ answer

    def matrix(self, film: np.ndarray, conductivity: float = 1.0):  # noqa: ANN201 (scipy is imported where it is needed)
        """Return the conductances (n_fine, n_fine) S between nodes, sparse: sum of sigma h grad N_i . grad N_j.
        film : (n,) m, h at the original nodes; conductivity : S/m, sigma"""
        if not (film > 0).all():  # false for NaN too
            raise ValueError("a film without thickness does not conduct")
        thickness = (self.prolong @ film)[self.faces].mean(1)  # exact for a film that is linear in each triangle
        matrix = self._pattern.copy()
        matrix.data = conductivity * (self._scatter @ thickness)
        return matrix

    def mean_over_electrodes(self, film: np.ndarray) -> np.ndarray:
        """Return the mean (k,) over each electrode of a film (n,) m, or of any other values, at the original nodes."""
        return (self.prolong @ film) @ self.patches

    def unresolved(self, refine: int) -> np.ndarray:
        """Return the resistance (k,) ohm near each electrode that this grid misses against a refined one, 1 m, 1 S/m.

        Near an electrode a film has nearly one thickness h: there it misses this value over conductivity times h.
        refine : how often the finer grid cuts each triangle into four"""
        film = np.ones(len(self.given[0]))
        miss = ThinSheet(*self.given, refine).potentials(film) - self.potentials(film)
        elsewhere = miss[~np.eye(len(miss), dtype=bool)]  # one constant, from the node where the current leaves
        return np.diag(miss) - np.median(elsewhere)

    def _prepare_matrix(self) -> None:
        """Find the matrix's sparsity pattern, and the weights that make its entries from the triangles' thicknesses."""
        import scipy.sparse

        local = _gradient_products(self.nodes[self.faces])
        rows, columns = np.repeat(self.faces, 3, 1).ravel(), np.tile(self.faces, 3).ravel()
        size = len(self.nodes)
        self._pattern = scipy.sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(size, size))
        self._pattern.sort_indices()
        keys = np.repeat(np.arange(size), np.diff(self._pattern.indptr)) * size + self._pattern.indices
        place = np.searchsorted(keys, rows.astype(np.int64) * size + columns)
        face = np.repeat(np.arange(len(self.faces)), 9)
        self._scatter = scipy.sparse.csr_matrix((local.ravel(), (place, face)), shape=(len(keys), len(self.faces)))


def resistances(potentials: np.ndarray, sensing: int) -> np.ndarray:
    """Return the resistances (sensing,) ohm from each of the first ``sensing`` electrodes to all later ones, joined.

    potentials : (k, k) V, from ``ThinSheet.potentials``. The joined electrodes are at one potential, and their currents
        add up to the single electrode's: a linear system for these currents and that potential.
    """
    joined = len(potentials) - sensing
    system = np.zeros((joined + 1, joined + 1))
    system[:joined, :joined], system[:joined, joined], system[joined, :joined] = potentials[sensing:, sensing:], -1, 1
    into = np.vstack([-potentials[sensing:, :sensing], -np.ones((1, sensing))])
    answer = np.linalg.solve(system, into)
    own = np.diag(potentials)[:sensing]
    return own + np.einsum("ej,je->e", potentials[:sensing, sensing:], answer[:joined]) - answer[joined]


def _gradient_products(corners: np.ndarray) -> np.ndarray:
    """Return area times grad N_i . grad N_j, (m, 3, 3), of triangles with corners (m, 3, 3) m."""
    edges = np.roll(corners, -2, 1) - np.roll(corners, -1, 1)  # the edge across from each corner
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    return np.einsum("fik,fjk->fij", edges, edges) / (4 * area[:, None, None])


def _halved(nodes: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, object]:
    """Cut each of the triangles faces (m, 3) on nodes (n, 3) m into four. Return the new nodes, one more on every edge,
    the new faces, and the sparse matrix that interpolates values linearly from old nodes to new ones."""
    import scipy.sparse

    ends = np.sort(np.stack([faces, np.roll(faces, -1, 1)], -1).reshape(-1, 2), 1)
    edges, which = np.unique(ends, axis=0, return_inverse=True)
    middle = len(nodes) + which.reshape(-1, 3)  # of the edges 01, 12, 20
    a, b, c = faces.T
    ab, bc, ca = middle.T
    cut = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    rows = len(nodes) + np.repeat(np.arange(len(edges)), 2)
    values = np.full(len(rows), 0.5)
    half = scipy.sparse.csr_matrix((values, (rows - len(nodes), edges.ravel())), shape=(len(edges), len(nodes)))
    finer = scipy.sparse.vstack([scipy.sparse.identity(len(nodes)), half]).tocsr()
    return finer @ nodes, cut, finer


def _disc(nodes: np.ndarray, faces: np.ndarray, size: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """Return weights (n,) of nodes (n, 3) m, of sum 1, for a function's mean over a disc of radius m at center (3,) m.
    faces : (m, 3), triangles; size : (m,) m, their longest edges"""
    near = np.flatnonzero(np.linalg.norm(nodes - center, axis=1)[faces].min(1) < radius + size)
    corners = nodes[faces[near]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    at = _sub_centroids(_DISC_SAMPLES)
    inside = np.linalg.norm(np.einsum("sk,fkd->fsd", at, corners) - center, axis=2) < radius
    weights = np.bincount(faces[near].ravel(), (area[:, None] * (inside @ at)).ravel(), minlength=len(nodes))
    if not weights.any():
        raise ValueError(f"an electrode at {center} m does not lie on the sheet")
    return weights / weights.sum()


def _sub_centroids(cuts: int) -> np.ndarray:
    """Return barycentric centroids (cuts^2, 3) of the equal triangles that a triangle is cut into."""
    place = np.stack(np.meshgrid(np.arange(cuts), np.arange(cuts)), -1).reshape(-1, 2)
    upright, turned = place[place.sum(1) < cuts], place[place.sum(1) < cuts - 1]
    uv = np.concatenate([upright + 1 / 3, turned + 2 / 3]) / cuts
    return np.column_stack([1 - uv.sum(1), uv])
