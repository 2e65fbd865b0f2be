"""The even and the odd half of a solid's motion put together again."""

from __future__ import annotations

import numpy as np


def axes_of(nodes: np.ndarray) -> np.ndarray:
    """Return the numbers (3 k,) of the degrees of freedom of nodes (k,)."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


class MirrorSymmetry:
    """Puts the even and the odd half of a motion together. ``half`` (k,) surface nodes with z >= 0; ``image`` (n,)."""

    def __init__(self, half: np.ndarray, image: np.ndarray) -> None:
        self.half, self.image = half, image
        self.sign = np.tile([1.0, 1.0, -1.0], len(half)).astype(np.float32)

    def loads(self, even: np.ndarray, odd: np.ndarray, column: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """Return the motion (w, 3 n) from the halves' (3 k, v): load i is ``column[i]``, mirrored for sign -1."""
        even, odd = even.T[column], odd.T[column] * sign[:, None]
        answer = np.empty((len(column), 3 * len(self.image)))
        answer[:, axes_of(self.image[self.half])] = (even - odd) * self.sign
        answer[:, axes_of(self.half)] = even + odd
        return answer

    def forces(self, even: np.ndarray, odd: np.ndarray, answered: np.ndarray) -> np.ndarray:
        """Return the motion (3 r, 3 n) float32 under unit forces on ``answered`` (r,), from the halves' (3 k, 3 k)."""
        here, there = axes_of(self.half), axes_of(self.image[self.half])
        move = np.empty((3 * len(answered), 3 * len(self.image)), np.float32)
        for i, node in enumerate(np.searchsorted(self.half, answered)):
            rows, answer = slice(3 * node, 3 * node + 3), move[3 * i : 3 * i + 3]
            answer[:, there] = (even[rows] - odd[rows]) * self.sign
            answer[:, here] = even[rows] + odd[rows]  # after the other: on the mirror plane this one is right
        return move
