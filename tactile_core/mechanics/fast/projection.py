"""Find where surface nodes meet an indenter that moves onto them."""

from __future__ import annotations

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ...geometry.indenters.indenter import lengths

_ARRIVED = 1e-8  # m, at which a point has landed
_TRACE_STEPS = 6  # of sphere tracing: the start of an iteration needs no more
_MET = 1e-10  # m, at which a point has met the indenter
_SPOT_STEPS = 20  # where a node sticks matters, so its spot is found to well below a micrometre


def project(indenter: Indenter, pose: Pose, points: np.ndarray, far: float) -> np.ndarray:
    """Return the displacements (n, 3) m along the motion that bring points (n, 3) m to an indenter's front at ``pose``.

    far : m, how deep points may lie in the indenter. Points that lie in front of it already stay.
    """
    own, travel, on_way = pose.to_own(points), np.full(len(points), far), np.arange(len(points))
    ahead = pose.own_direction
    for _ in range(_TRACE_STEPS):
        place = own.take(on_way, axis=0) + travel[on_way, None] * ahead
        gap, _ = indenter.distance(place)
        travel[on_way] -= np.maximum(gap, 0)
        on_way = on_way[(gap > _ARRIVED) & (travel[on_way] > 0)]
        if not len(on_way):
            break
    return np.maximum(travel, 0)[:, None] * pose.direction


def first_contact(indenter: Indenter, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return where (n, 3), in its frame, nodes that move from ``first`` to ``last`` (n, 3) m first meet an indenter.

    Points that it does not meet are given as they stand at the end.
    """
    way = last - first
    share, on_way = np.zeros(len(first)), np.arange(len(first))
    start, ahead, gone, length = first, way, share.copy(), np.maximum(lengths(way), 1e-12)  # of those on their way
    for _ in range(_SPOT_STEPS):
        gap, _ = indenter.distance(start + gone[:, None] * ahead)
        gone = np.minimum(gone + np.maximum(gap, 0) / length, 1)
        share[on_way] = gone
        left = np.flatnonzero((gap > _MET) & (gone < 1))
        if not len(left):
            break
        if len(left) < len(on_way):
            on_way, start, ahead = on_way[left], start.take(left, axis=0), ahead.take(left, axis=0)
            gone, length = gone[left], length[left]
    return first + share[:, None] * way
