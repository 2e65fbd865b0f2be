"""Signed distance of an outline extruded along an axis and rounded: the body of cylinders and wedges.

Of a straight prism, with distances d to its outline and e to its ends: hypot(max(d, 0), max(e, 0)) + min(max(d, e), 0).
The edge radius, which inflates the prism, is then subtracted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .indenter import NEAREST


class Outline(NamedTuple):
    """Signed distance of a plane figure at n places: ``value`` (n,) m, positive outside, and its gradient ``slope`` (n,
    2).
    radius : (n,) m, of curvature of the line of equal distance through each place; infinite if that is straight"""

    value: np.ndarray
    slope: np.ndarray
    radius: np.ndarray


def disc(across: np.ndarray, radius: float) -> Outline:
    """Return the outline of a disc about the origin, radius m (0: a point), at places ``across`` (n, 2) m."""
    length = np.sqrt(np.einsum("ni,ni->n", across, across))
    centre = length < NEAREST
    length = np.maximum(length, NEAREST)
    slope = across / length[:, None]
    slope[centre] = [0.0, -1.0]
    return Outline(length - radius, slope, length)


def distance(outline: Outline, along: np.ndarray, half_span: float, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the signed distance (n,) m from a rounded prism and its gradient (n, 3), two components across, one along.
    outline : of the prism, at the places across; along : (n,) m, the places along its axis, from its middle
    half_span : m, half the prism's length before it is inflated by ``edge`` m"""
    side, end = outline.value, np.abs(along) - half_span
    across, beyond, corner = _corner(side, end)
    found, far = corner - edge, corner
    if corner.min(initial=np.inf) == 0:
        inside = np.flatnonzero(corner == 0)
        found[inside] += np.maximum(side[inside], end[inside])
        far = corner.copy()
        far[inside] = 1.0
        across[inside] = side[inside] > end[inside]
        beyond[inside] = side[inside] <= end[inside]
    gradient = np.empty((len(along), 3))
    np.multiply((across / far)[:, None], outline.slope, out=gradient[:, :2])
    np.copysign(beyond / far, along, out=gradient[:, 2])
    return found, gradient


def curvature(outline: Outline, along: np.ndarray, half_span: float) -> np.ndarray:
    """Return the second derivatives (n, 3, 3) 1/m of ``distance``; outline, along (n,) m, half_span m as there"""
    side, end = outline.value, np.abs(along) - half_span
    across, beyond, corner = _corner(side, end)
    # On a round corner the normal turns in the plane of the outline's normal and the axis.
    turn = np.column_stack([-beyond[:, None] * outline.slope, np.where(along >= 0, across, -across)])
    length = np.maximum(corner, NEAREST)
    round_corner = (across > 0) & (beyond > 0)
    hessian = (round_corner / length**3)[:, None, None] * (turn[:, :, None] * turn[:, None, :])
    on_side = np.where(corner > 0, across / np.maximum(corner, NEAREST**2), side > end)
    turn = np.column_stack([-outline.slope[:, 1], outline.slope[:, 0]])
    hessian[:, :2, :2] += (on_side / outline.radius)[:, None, None] * (turn[:, :, None] * turn[:, None, :])
    return hessian


def _corner(side: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    across, beyond = np.maximum(side, 0), np.maximum(end, 0)
    return across, beyond, np.sqrt(across * across + beyond * beyond)
