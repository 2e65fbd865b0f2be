"""Whether a surface follows the body pressed into it, or has let it through between its nodes.

Contact is looked at in nodes. A body narrower than their spacing, or one from whose tip frictionless nodes have slid
away, sinks in between them: every node is in equilibrium, and the answer is wrong.
"""

from __future__ import annotations

import numpy as np

from ..errors import TactileError
from ..indenters import Indenter, Pose
from .first_touch import in_front

# What lattices hide under a body that they resolve: in 2,154 random contacts of nine indenters on both sensors, with
# friction and without, up to 97 um, and where it was more than 50 um a third of the depth at most.
_HIDDEN, _SHARE = 100e-6, 0.4  # m, and of the depth
_BLUNT = 1.5e-3  # m: a tip this round hides 21 um between nodes half a millimetre apart, and no node slides off it
_ON_BODY = 1e-6  # m: a ring's foremost point, the middle of its hole, is no part of it


def sunk(grid: np.ndarray, indenter: Indenter, pose: Pose, *, closed: bool) -> float:
    """How deep, m, a body's foremost point lies under a surface (rows, columns, 3) m; 0 where that says nothing."""
    foremost = pose.support(indenter, pose.direction)
    met = None
    if abs(pose.distance(indenter, foremost[None])[0][0]) < _ON_BODY:
        met = in_front(np.ascontiguousarray(np.moveaxis(grid, 2, 0)), indenter, pose, closed=closed)
    return 0.0 if met is None else float((foremost - met[1][0]) @ pose.direction)


def check_follows(where: str, grid: np.ndarray, indenter: Indenter, pose: Pose, depth: float, *, closed: bool) -> None:
    """Raise TactileError where a body pressed ``depth`` m in has sunk in between a surface's nodes."""
    foremost = pose.support(indenter, pose.direction)[None]
    if np.abs(pose.curvature(indenter, foremost)).max() * _BLUNT < 1:
        return
    below = sunk(grid, indenter, pose, closed=closed)
    if below > max(_HIDDEN, _SHARE * depth):
        found = f"the indenter's tip has sunk {below * 1e3:.3f} mm in between the surface's nodes"
        advice = "Use a blunter one, press less, or a finer tier"
        raise TactileError(where, found, "an indenter that they resolve", advice)
