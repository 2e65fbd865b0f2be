"""Check that a surface follows the body pressed into it, and does not let it through between its nodes.

Contact is solved at nodes. A body narrower than their spacing, or one from whose tip frictionless nodes have slid away,
sinks in between them; nodes that slide round a wire pressed deeper than its radius end up behind it and push it on.
Every node is then in equilibrium, and the answer is wrong.
"""

from __future__ import annotations

import numpy as np

from ..errors import TactileError
from ..geometry.cubic_spline import on_grid
from ..geometry.indenters import Indenter, Pose
from .placement import in_front

# Penetration between nodes under the tip of a body that the lattice resolves: in 2,154 random contacts of nine
# indenters on both sensors, with and without friction, 97 um at most, and where above 50 um a third of the depth.
_LEAST, _SHARE = 100e-6, 0.4  # m, and of the depth
# m, penetration that penalty points leave alone: with 5 um the force of a 14 mm ball 0.1 mm deep was 8 % too large
SLACK = 20e-6
BLUNT = 1.5e-3  # m: a tip this round hides 21 um between nodes half a millimetre apart, and no node slides off it
_ON_BODY = 1e-6  # m, from a body's foremost point to the body; a ring's, the middle of its hole, is farther
# Cosine of normals and motion at nodes that carry force. Down to -0.27 where the reference tier agreed (rings 1.6 mm
# deep), -0.8 and below where forces were a tenth of its, or pulled (270 random contacts, and paths of rings).
BEHIND = -0.5
_CLOSE = 0.3e-3  # m, from the body to the nodes between which it may have sunk in (assumed)
_BETWEEN = np.stack(np.meshgrid([-0.5, 0.0, 0.5], [-0.5, 0.0, 0.5], indexing="ij")).reshape(2, -1)


class PenetrationError(TactileError):
    """Error for a body that has passed between a surface's nodes; a finer surface may hold it."""


def penetration_between(
    where: str, grid: np.ndarray, indenter: Indenter, pose: Pose, depth: float, *, closed: bool, share: float = _SHARE
) -> float:
    """Return the largest penetration, m, of an indenter through a surface ``grid`` (rows, columns, 3) m, at nodes and
    halfway between them; 0 if it reaches none of these.

    closed : true if the grid's last column joins the first; where : begins the error's text
    Raises PenetrationError if it is over 0.1 mm and over ``share`` of the indenter's ``depth``, m from first touch."""
    columns = grid.shape[1]
    gap, _ = pose.distance(indenter, grid.reshape(-1, 3))
    near = np.array(np.divmod(np.flatnonzero(gap < _CLOSE), columns), float)
    if not near.size:
        return 0.0
    places = (near[:, :, None] + _BETWEEN[:, None]).reshape(2, -1)
    points = on_grid(np.ascontiguousarray(np.moveaxis(grid, 2, 0)), places, closed=closed)
    below = max(-float(pose.distance(indenter, points)[0].min()), 0.0)
    if below > max(_LEAST, share * depth):
        found = f"the indenter has sunk {below * 1e3:.3f} mm in between the surface's nodes"
        raise _let_through(where, found)
    return below


def penetration(grid: np.ndarray, indenter: Indenter, pose: Pose, *, closed: bool) -> float:
    """Return how far, m, an indenter's foremost point lies under a surface ``grid`` (rows, columns, 3) m, negative
    above it; 0 if no node is near that point's path, or the point is not on the body (the middle of a ring).
    closed : true if the grid's last column joins the first"""
    foremost = pose.support(indenter, pose.direction)
    met = None
    if abs(pose.distance(indenter, foremost[None])[0][0]) < _ON_BODY:
        met = in_front(np.ascontiguousarray(np.moveaxis(grid, 2, 0)), indenter, pose, closed=closed)
    return 0.0 if met is None else float((foremost - met[1][0]) @ pose.direction)


def check_follows(
    where: str, grid: np.ndarray, indenter: Indenter, pose: Pose, depth: float, normals: np.ndarray, *,
    closed: bool, behind: float = BEHIND,
) -> None:  # fmt: skip
    """Raise PenetrationError if an indenter, ``depth`` m beyond first touch, has passed between a surface's nodes.
    where : begins the error's text; grid : (rows, columns, 3) m, the nodes; closed : true if its last column joins the
        first
    normals : (k, 3), outward, of the indenter at the k nodes that carry force; k is 0 if a body has passed them all
    behind : least allowed cosine between those normals and the motion; lower ones lie on the indenter's back"""
    if (normals @ pose.direction).min(initial=1.0) < behind:
        found = "the indenter has sunk in between the surface's nodes: some lie on its back"
        raise _let_through(where, found)
    foremost = pose.support(indenter, pose.direction)[None]
    if len(normals) and np.abs(pose.curvature(indenter, foremost)).max() * BLUNT < 1:
        return
    below = penetration(grid, indenter, pose, closed=closed)
    if below > max(_LEAST, _SHARE * depth):
        found = f"the indenter's tip has sunk {below * 1e3:.3f} mm in between the surface's nodes"
        raise _let_through(where, found)


def _let_through(where: str, found: str) -> PenetrationError:
    advice = "Use a blunter one, friction, a finer tier, or press less"
    return PenetrationError(where, found, "an indenter that they resolve", advice)


# m, radius of an edge below which the fast tier's errors are taken to grow as 1 / sqrt(radius), as the contact narrows
# (assumed form). Of 101 wedges and bumps of 0.2 to 1 mm, 96 shapes and 98 forces were then off the full tier by no more
# than stated; with 0.4 mm and no growth 81 and 91. Those of 0.1 mm, off 1.8 to 2.7 times the table's, are covered too.
RESOLVED_RADIUS = 1.5e-3
# m, radius of the sharpest edges that get penalty points: with a wedge of 0.1 mm the gel's solve failed, after two
# minutes; edges of 0.4 mm are held.
BENDS = 0.2e-3
_LEAST_RADIUS = 10e-6  # m, below which an edge acts like one of this radius
_NEAR = 0.5e-3  # m, from the indenter to points whose curvature counts


def sharpest(indenter: Indenter, pose: Pose, points: np.ndarray) -> float:
    """Return an indenter's least radius of curvature, m, at its tip and at those of ``points`` (n, 3) m that lie within
    0.5 mm outside it; at least 10 um, and infinity if none is so near."""
    points = np.concatenate([points, pose.support(indenter, pose.direction)[None]])  # no node may be near a blade's
    gap, _ = pose.distance(indenter, points)
    near = (gap > -_LEAST_RADIUS) & (gap < _NEAR)
    if not near.any():
        return np.inf
    bend = pose.curvature(indenter, points[near])  # of the level surface through each point
    total, square = np.einsum("kii->k", bend), np.einsum("kij,kij->k", bend, bend)
    larger = (total + np.sqrt(np.maximum(2 * square - total**2, 0.0))) / 2  # of the two principal curvatures
    radius = 1 / np.maximum(larger, 1e-9) - np.maximum(gap[near], 0.0)
    return max(float(radius.min()), _LEAST_RADIUS)
