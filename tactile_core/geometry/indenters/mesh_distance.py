"""Exact distance to the triangles of a mesh, by search among those in cells near a point."""

from __future__ import annotations

import functools

import numpy as np

from ...files.compiled import Loop, available

_LONGEST = 700_000  # cells, most for the sum of all triangles' longest edges: some 1.6 million pieces of slender ones
_TOGETHER = 20_000  # points looked up at a time without numba


class NearTriangles:
    """Search index of triangles (m, 3, 3), any unit: they are cut into pieces no longer than ``cell``, which are sorted
    into cubes of that side; many long triangles get a larger cell. middles : (k, 3), of the pieces"""

    def __init__(self, triangles: np.ndarray, cell: float) -> None:
        cell = max(cell, float(_sides(triangles).max(axis=1).sum()) / _LONGEST)
        pieces, self._owner = _pieces(triangles, cell / np.sqrt(2))  # their diagonals are then about as long as a cell
        self.middles = pieces.mean(axis=1)
        self._cell, self._origin = cell, pieces.min(axis=(0, 1))
        self._triangles = np.ascontiguousarray((triangles - self._origin) / cell)
        place = np.floor((self.middles - self._origin) / cell).astype(np.int64)
        self._shape = place.max(axis=0) + 1
        flat = np.ravel_multi_index(tuple(place.T), tuple(self._shape))
        order = np.argsort(flat, kind="stable")
        flat, self._members = flat[order], self._owner[order]
        around = np.linalg.norm(pieces - self.middles[:, None], axis=2).max(axis=1)
        self._reach, normals = around.max(), np.cross(*np.moveaxis(np.diff(triangles, axis=1), 1, 0))
        normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
        places = np.column_stack([self.middles - self._origin, around]) / cell
        self._discs = np.column_stack([places, normals[self._owner]])[order]
        self._starts = np.searchsorted(flat, np.arange(np.prod(self._shape) + 1))
        self._boxes = np.zeros((np.prod(self._shape), 2, 3))
        first = np.flatnonzero(np.diff(flat, prepend=-1))
        corners = (pieces[order] - self._origin) / cell
        self._boxes[flat[first], 0] = np.minimum.reduceat(corners.min(axis=1), first)
        self._boxes[flat[first], 1] = np.maximum.reduceat(corners.max(axis=1), first)

    def distance(self, points: np.ndarray, bound: float) -> np.ndarray:
        """Return the distance (n,) from points (n, 3) to the nearest triangle; inf if it is ``bound`` or more."""
        if not available():
            return self._by_tree(points, bound)
        farthest = int(np.ceil(bound / self._cell)) + 1  # a piece reaches into the next cell
        places = (points - self._origin) / self._cell
        cells = np.floor(places).astype(np.int64)
        order = np.argsort(cells @ [2**42, 2**21, 1], kind="stable")  # neighbours share what is looked up
        squares = np.empty(len(points))
        squares[order] = _least_squares(
            places[order], cells[order], self._triangles, self._starts, self._members, self._discs, self._boxes,
            self._shape, farthest, (bound / self._cell) ** 2,
        )  # fmt: skip
        return self._cell * np.sqrt(squares)

    def _by_tree(self, points: np.ndarray, bound: float) -> np.ndarray:
        """Return what ``distance`` does, without numba, by searching ever more of the pieces nearest to each of points
        until no other can be nearer than ``bound`` or what was found."""
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
    """Cut triangles (m, 3, 3) until no edge is longer than ``longest``. Return four-sided pieces (k, 4, 3) and the
    index of each one's triangle (k,).

    Two opposite edges are halved at a time, first the two beside a triangle's shortest: the number of pieces of a
    slender triangle then grows with its length, not the square of it."""
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
def _least_squares(places, cells, triangles, starts, members, discs, boxes, shape, farthest, bound):  # noqa: ANN001, ANN202
    """Return the squared distance (n,), in cells, from places (n, 3) to the nearest triangle; inf from ``bound``,
    squared too, on.

    The piece nearest to the place before comes first. Then come those, in cells at most ``farthest`` from a place's
    own, whose cell's box (2, 3) and whose disc (middle, radius, normal) are nearer than what was found. Boxes are first
    measured from the first place of a cell: from the others they are nearer by at most the way between. A foot inside
    the triangle gives the distance to its plane, any other the distance to its nearest edge."""
    squares, normal, arm, edge = np.empty(len(places)), np.empty(3), np.empty(3), np.empty(3)
    most = (2 * farthest + 1) * (2 * farthest + 1) * (2 * farthest + 1)
    around, aways = np.empty(most, np.int64), np.empty(most)
    seen, first, count, nearest = np.full(len(triangles), -1), 0, 0, 0
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for p in range(len(places)):
        same, moved = p > 0, 0.0
        for a in range(3):
            same = same and cells[p, a] == cells[first, a]
        if not same:
            first, count = p, 0
            for a in range(3):
                low[a], high[a] = max(cells[p, a] - farthest, 0), min(cells[p, a] + farthest + 1, shape[a])
            for i in range(low[0], high[0]):
                for j in range(low[1], high[1]):
                    row = (i * shape[1] + j) * shape[2]
                    if high[2] <= low[2] or starts[row + low[2]] == starts[row + high[2]]:
                        continue
                    for cell in range(row + low[2], row + high[2]):
                        if starts[cell] == starts[cell + 1]:
                            continue
                        away = 0.0
                        for a in range(3):
                            beyond = max(boxes[cell, 0, a] - places[p, a], places[p, a] - boxes[cell, 1, a], 0.0)
                            away += beyond * beyond
                        around[count], aways[count] = cell, np.sqrt(away)
                        count += 1
        for a in range(3):
            moved += (places[p, a] - places[first, a]) * (places[p, a] - places[first, a])
        moved, best, least = np.sqrt(moved), bound, np.sqrt(bound)
        for q in range(-1, count):
            start, end = nearest, nearest + 1
            if q >= 0:
                if aways[q] >= least + moved:
                    continue
                cell, away = around[q], 0.0
                for a in range(3):
                    beyond = max(boxes[cell, 0, a] - places[p, a], places[p, a] - boxes[cell, 1, a], 0.0)
                    away += beyond * beyond
                if away >= best:
                    continue
                start, end = starts[cell], starts[cell + 1]
            for m in range(start, end):
                if seen[members[m]] == p:
                    continue
                away, reach, height = 0.0, least + discs[m, 3], 0.0
                for a in range(3):
                    beyond = places[p, a] - discs[m, a]
                    away += beyond * beyond
                    height += beyond * discs[m, 4 + a]
                if away >= reach * reach:
                    continue
                beside = np.sqrt(max(away - height * height, 0.0)) - discs[m, 3]
                if height * height + max(beside, 0.0) * beside >= best:
                    continue
                seen[members[m]] = p
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
                if best < least * least:
                    least, nearest = np.sqrt(best), m
        squares[p] = best if best < bound else np.inf
    return squares
