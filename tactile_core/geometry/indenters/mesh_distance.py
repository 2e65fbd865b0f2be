"""Exact distance to the triangles of a mesh, looked up in cells near a point."""

from __future__ import annotations

import functools

import numpy as np

from ...files.compiled import Loop, available

_LONGEST = 700_000  # cells, most for the sum of all triangles' longest edges: some 1.6 million pieces of slender ones
_TOGETHER = 20_000  # points looked up at a time without numba


class NearTriangles:
    """Search index of triangles (m, 3, 3), any unit: cut into pieces no longer than ``cell``, sorted into cubes of that
    side; it is raised for many long triangles. middles : (k, 3), of the pieces"""

    def __init__(self, triangles: np.ndarray, cell: float) -> None:
        cell = max(cell, float(_sides(triangles).max(axis=1).sum()) / _LONGEST)
        pieces, self._owner = _pieces(triangles, cell / np.sqrt(2))  # their diagonals are then about as long as a cell
        self.middles = pieces.mean(axis=1)
        self._reach = np.linalg.norm(pieces - self.middles[:, None], axis=2).max()
        self._cell, self._origin = cell, pieces.min(axis=(0, 1))
        self._triangles = np.ascontiguousarray((triangles - self._origin) / cell)
        place = np.floor((self.middles - self._origin) / cell).astype(np.int64)
        self._shape = place.max(axis=0) + 1
        flat = np.ravel_multi_index(tuple(place.T), tuple(self._shape))
        order = np.lexsort((self._owner, flat))
        flat, self._members = flat[order], self._owner[order]
        self._starts = np.searchsorted(flat, np.arange(np.prod(self._shape) + 1))
        self._boxes = np.zeros((np.prod(self._shape), 2, 3))
        first = np.flatnonzero(np.diff(flat, prepend=-1))
        corners = (pieces[order] - self._origin) / cell
        self._boxes[flat[first], 0] = np.minimum.reduceat(corners.min(axis=1), first)
        self._boxes[flat[first], 1] = np.maximum.reduceat(corners.max(axis=1), first)

    def distance(self, points: np.ndarray, bound: float) -> np.ndarray:
        """Return the distance (n,) from points (n, 3) to the nearest triangle, inf where it is ``bound`` or more."""
        if not available():
            return self._by_tree(points, bound)
        farthest = int(np.ceil(bound / self._cell)) + 1  # a piece reaches into the next cell
        along = np.arange(-farthest, farthest + 1)
        steps = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1).reshape(-1, 3)
        steps = steps[np.argsort((steps**2).sum(axis=1), kind="stable")]
        places = (points - self._origin) / self._cell
        cells = np.floor(places).astype(np.int64)
        order = np.lexsort(cells.T)  # neighbours share what is looked up
        squares = np.empty(len(points))
        squares[order] = _least_squares(
            places[order], cells[order], self._triangles, self._starts, self._members, self._boxes, self._shape, steps,
            (bound / self._cell) ** 2,
        )  # fmt: skip
        return self._cell * np.sqrt(squares)

    def _by_tree(self, points: np.ndarray, bound: float) -> np.ndarray:
        """See ``distance``; without numba: looks at ever more of the nearest pieces until no other can be nearer."""
        import scipy.spatial
        import trimesh

        triangles, tree = self._triangles * self._cell + self._origin, scipy.spatial.cKDTree(self.middles)
        least = np.full(len(points), np.inf)
        for left in np.array_split(np.arange(len(points)), len(points) // _TOGETHER + 1):
            count = 4
            while len(left):
                count = min(4 * count, tree.n)
                away, piece = tree.query(points[left], np.arange(count) + 1, distance_upper_bound=bound + self._reach)
                row, column = np.nonzero(np.isfinite(away))
                at = points[left[row]]
                foot = trimesh.triangles.closest_point(triangles[self._owner[piece[row, column]]], at)
                np.minimum.at(least, left[row], np.linalg.norm(foot - at, axis=1))
                left = left[(away[:, -1] - self._reach < least[left]) & (away[:, -1] < np.inf) & (count < tree.n)]
        return np.where(least < bound, least, np.inf)


def _sides(corners: np.ndarray) -> np.ndarray:
    """Return the lengths (k, n) of the edges of k polygons with n corners (k, n, 3)."""
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def _pieces(triangles: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Cut triangles (m, 3, 3) until no edge is above ``longest``; returns four-sided pieces (k, 4, 3), their triangles
    (k,).

    Two opposite edges are halved at a time, first the two beside a triangle's shortest: the number of pieces of a
    slender one then grows as its length, not its square."""
    order = (_sides(triangles).argmin(axis=1)[:, None] + [0, 1, 2, 2]) % 3  # the last edge but one has no length
    whole, owner, pieces, owners = np.take_along_axis(triangles, order[:, :, None], 1), np.arange(len(order)), [], []
    while len(whole):
        sides = _sides(whole)
        done = sides.max(axis=1) <= longest
        pieces.append(whole[done])
        owners.append(owner[done])
        whole, owner, worst = whole[~done], owner[~done], sides[~done].argmax(axis=1)
        row = np.arange(len(whole))
        a, b, c, d = (whole[row, (worst + k) % 4] for k in range(4))
        e, f = (a + b) / 2, (c + d) / 2
        whole = np.concatenate([np.stack([a, e, f, d], axis=1), np.stack([e, b, c, f], axis=1)])
        owner = np.tile(owner, 2)
    return np.concatenate(pieces), np.concatenate(owners)


@functools.partial(Loop, waits=False)  # many cells and triangles for each of few points
def _least_squares(places, cells, triangles, starts, members, boxes, shape, steps, bound):  # noqa: ANN001, ANN202
    """Squared distance (n,) from places (n, 3) to the nearest triangle, inf from ``bound`` on, squared too; unit:
    cells.

    Cells are visited by ``steps`` (q, 3) from a place's own, where the box (2, 3) of what they hold is near enough. A
    foot inside the triangle gives the distance to its plane, any other the distance to its nearest edge."""
    squares, normal, arm, edge = np.empty(len(places)), np.empty(3), np.empty(3), np.empty(3)
    around, count = np.empty(len(steps), np.int64), 0
    for p in range(len(places)):
        same = p > 0
        for a in range(3):
            same = same and cells[p, a] == cells[p - 1, a]
        if not same:
            count = 0
            for q in range(len(steps)):
                cell, within = 0, True
                for a in range(3):
                    at = cells[p, a] + steps[q, a]
                    within = within and 0 <= at < shape[a]
                    cell = cell * shape[a] + at
                if within and starts[cell] < starts[cell + 1]:
                    around[count] = cell
                    count += 1
        best = bound
        for q in range(count):
            cell = around[q]
            away = 0.0
            for a in range(3):
                outside = max(boxes[cell, 0, a] - places[p, a], places[p, a] - boxes[cell, 1, a], 0.0)
                away += outside * outside
            if away >= best:
                continue
            for m in range(starts[cell], starts[cell + 1]):
                if m > starts[cell] and members[m] == members[m - 1]:
                    continue
                corners = triangles[members[m]]
                for a in range(3):
                    b, c = (a + 1) % 3, (a + 2) % 3
                    normal[a] = (corners[1, b] - corners[0, b]) * (corners[2, c] - corners[0, c])
                    normal[a] -= (corners[1, c] - corners[0, c]) * (corners[2, b] - corners[0, b])
                foot_inside = True
                for v in range(3):
                    along, length = 0.0, 0.0
                    for a in range(3):
                        arm[a] = places[p, a] - corners[v, a]
                        edge[a] = corners[(v + 1) % 3, a] - corners[v, a]
                        along += arm[a] * edge[a]
                        length += edge[a] * edge[a]
                    share = min(max(along / length, 0.0), 1.0) if length > 0 else 0.0
                    square, side = 0.0, 0.0
                    for a in range(3):
                        b, c = (a + 1) % 3, (a + 2) % 3
                        apart = arm[a] - share * edge[a]
                        square += apart * apart
                        side += (normal[b] * edge[c] - normal[c] * edge[b]) * arm[a]
                    foot_inside = foot_inside and side > 0
                    best = min(best, square)
                if foot_inside:
                    height, area = 0.0, 0.0
                    for a in range(3):
                        height += normal[a] * arm[a]
                        area += normal[a] * normal[a]
                    best = min(best, height * height / area)
        squares[p] = best if best < bound else np.inf
    return squares
