"""Surfaces that show indenters; what presses is their signed distance."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .indenter import Indenter
    from .pose import Pose

Surface = tuple[np.ndarray, np.ndarray]  # nodes (n, 3) m in the body's frame, triangles (m, 3)
Hull = Callable[[Callable[[np.ndarray], np.ndarray]], Surface]  # surface of a convex body, by its ``support``


def joined(parts: Iterable[tuple[Indenter, Pose]], hull: Hull) -> Surface:
    """Join the surfaces of bodies, each in its pose, into one."""
    nodes, faces, count = [], [], 0
    for body, pose in parts:
        own, triangles = body.preview(hull)
        nodes.append(pose.from_own(own))
        faces.append(triangles + count)
        count += len(own)
    return np.concatenate(nodes), np.concatenate(faces)
