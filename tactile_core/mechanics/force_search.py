"""Search for the depth at which a contact bears a given force."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ..errors import TactileError
from .placement import DEPTH_LIMIT

# Relative to the force asked for, in every tier: 1/20 of the fast tier's error, 1/10 of the full tier's. A contact
# states the force that it has.
FORCE_TOLERANCE = 1e-3
# N: a ball of 150 mm radius, nearly a plate, bears 289 N on the DIGIT's gel at the greatest depth and 41 N on the
# BioTac's skin. A search for more would solve minutes of contacts of the whole gel on its way.
MOST_FORCE = 500.0
_STEPS = 30
_LEAST_SHARE = 1e-3  # of the interval between two depths: the smallest step of a search


class UnreachableError(TactileError):
    """Error for a depth beyond the limit, or for a force that no depth up to the limit gives."""


_Found = TypeVar("_Found", bound=Any)  # a contact at a ``depth``, m, under a ``force`` (3,) N


def touch_at_force(
    move: Callable[[float, _Found], _Found],
    last: _Found,
    direction: np.ndarray,
    force: float,
    limit: float,
    where: str,
    guess: float | None = None,
    slid_to: float | None = None,
) -> _Found:
    """Find the contact whose force along the unit vector ``direction`` (3,) is ``force``, N, to a thousandth, by
    secants of F^(2/3) and bisection.
    move : function of a depth, m, and a solved contact to start from; solves the contact at that depth
    last : the contact to begin from
    limit : m, greatest depth; guess : m, a depth near the one sought (None: an eighth of the limit)
    slid_to : m, depth of first touch here if the indenter has slid since ``last``, else None
    Raises TactileError, which begins with ``where``, if 30 steps find no depth; UnreachableError beyond the limit."""
    goal, before = _root(force), last
    low, high = (before.depth, _root(before.force @ direction)) if slid_to is None else (slid_to, 0.0), None
    lets_go = low[1] > goal  # the last contact bears more: go back toward first touch
    if lets_go:
        low, high = (0.0, 0.0), low
    depth = _next_depth(low, high, goal, limit) if lets_go else max(low[0], min(guess, limit) if guess else limit / 8)
    for attempt in range(_STEPS):
        if depth > limit:
            raise unreachable(where, force, limit)
        touch = move(depth, before)
        found = float(touch.force @ direction)
        if abs(found - force) <= FORCE_TOLERANCE * force:
            return touch
        if found < force:
            before, low = before if lets_go else touch, (depth, _root(found))
        else:
            high = (depth, _root(found))
        depth = _next_depth(low, high, goal, limit, halve=attempt % 3 == 2)
    between = f"force {force:g} N, between depths {low[0] * 1e3:.4f} and {depth * 1e3:.4f} mm"
    raise TactileError(where, between, "one that a search finds", "Give a depth")


def unreachable(where: str, force: float, limit: float) -> UnreachableError:
    """Return the error for a force, N, that no depth up to the limit, m, gives; ``where`` begins its text."""
    expected = f"a force that is found within {limit * 1e3:.2f} mm, {DEPTH_LIMIT:.0%} of the thickness here"
    return UnreachableError(where, f"force {force:g} N", expected, "Press less, or to a depth")


def _root(force: float) -> float:
    """Return force^(2/3), which is nearly linear in depth (Hertz); force : N, of a negative one 0"""
    return max(float(force), 0.0) ** (2 / 3)


def _next_depth(
    low: tuple[float, float], high: tuple[float, float] | None, goal: float, limit: float, *, halve: bool = False
) -> float:
    """Return the depth, m, to try next for F^(2/3) = goal, from known pairs (depth, F^(2/3)): ``low`` below the goal,
    and ``high`` above it or None.
    limit : m, greatest depth, a quarter of which is the longest step up; halve : true to bisect, not by secant"""
    if high is None:
        slope = low[1] / low[0] if low[0] else 0.0
        return low[0] + min((goal - low[1]) / slope if slope else np.inf, limit / 4)
    if halve and not low[1]:  # first touch of a node lies anywhere between them, however small
        return float(np.sqrt(max(low[0], _LEAST_SHARE * high[0]) * high[0]))
    share = 0.5 if halve else (goal - low[1]) / (high[1] - low[1])
    return low[0] + float(np.clip(share, _LEAST_SHARE, 1 - _LEAST_SHARE)) * (high[0] - low[0])
