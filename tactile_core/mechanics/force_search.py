"""The search for the depth at which a contact bears a force."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from ..errors import TactileError
from .thickness import DEPTH_LIMIT

TOLERANCE = 1e-4  # relative, of the force
ROUGH = 0.1  # relative, of the force and the depth that a mesh is made for
_STEPS = 30
_LEAST_SHARE = 1e-3  # of the way between two depths, that a search goes


class _Pressed(Protocol):
    """A contact at a ``depth``, m, under a ``force`` (3,) N."""

    depth: float
    force: np.ndarray


_Found = TypeVar("_Found", bound=_Pressed)


def touch_at_force(
    move: Callable[[float, _Found], _Found],
    last: _Found,
    direction: np.ndarray,
    force: float,
    limit: float,
    where: str,
    tolerance: float = TOLERANCE,
) -> _Found:
    """The contact at a force, N, along ``direction`` (3,), by secants of F^(2/3), nearly straight in the depth, and
    halving.

    move : the contact at a depth, m, from one before; last : where the search begins; limit : greatest depth, m
    tolerance : relative, of the force; where it is rough a depth as well known will do
    Raises TactileError, which begins with ``where``, for a force that is not found within the limit.
    """
    goal, before = _root(force), last
    low, high = (before.depth, _root(before.force @ direction)), None
    lets_go = low[1] > goal
    if lets_go:
        low, high = (0.0, 0.0), low
    depth = _next_depth(low, high, goal, limit) if lets_go else max(low[0], limit / 8)
    for attempt in range(_STEPS):
        if depth > limit:
            raise unreachable(where, force, limit)
        touch = move(depth, before)
        found = float(touch.force @ direction)
        if abs(found - force) <= tolerance * force:
            return touch
        if found < force:
            before, low = before if lets_go else touch, (depth, _root(found))
        else:
            high = (depth, _root(found))
        if tolerance >= ROUGH and high and high[0] - low[0] < tolerance * high[0]:
            return touch
        depth = _next_depth(low, high, goal, limit, halve=attempt % 3 == 2)
    found = f"force {force:g} N, between depths {low[0] * 1e3:.4f} and {depth * 1e3:.4f} mm"
    raise TactileError(where, found, "one that a search finds", "Give a depth")


def unreachable(where: str, force: float, limit: float) -> TactileError:
    """Return the error for a force, N, that no depth within the limit, m, gives."""
    expected = f"a force that is found within {limit * 1e3:.2f} mm, {DEPTH_LIMIT:.0%} of the thickness here"
    return TactileError(where, f"force {force:g} N", expected, "Press less, or to a depth")


def _root(force: float) -> float:
    """F^(2/3), which grows nearly straight with depth."""
    return max(float(force), 0.0) ** (2 / 3)


def _next_depth(
    low: tuple[float, float], high: tuple[float, float] | None, goal: float, limit: float, *, halve: bool = False
) -> float:
    """The depth, m, to try next for a root of the force, between the (depth, root) below and above it, or beyond."""
    if high is None:
        slope = low[1] / low[0] if low[0] else 0.0
        return low[0] + min((goal - low[1]) / slope if slope else np.inf, limit / 4)
    if halve and not low[1]:  # first touch of a node lies anywhere between them, however small
        return float(np.sqrt(max(low[0], _LEAST_SHARE * high[0]) * high[0]))
    share = 0.5 if halve else (goal - low[1]) / (high[1] - low[1])
    return low[0] + float(np.clip(share, _LEAST_SHARE, 1 - _LEAST_SHARE)) * (high[0] - low[0])
