"""Surfaces that show indenters; what presses is their signed distance."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .indenter import Hull, Indenter, Surface
from .pose import Pose


def joined(parts: Iterable[tuple[Indenter, Pose]], hull: Hull) -> Surface:
    """Join the surfaces of bodies, each in its pose, into one."""
    nodes, faces, count = [], [], 0
    for body, pose in parts:
        own, triangles = body.preview(hull)
        nodes.append(pose.from_own(own))
        faces.append(triangles + count)
        count += len(own)
    return np.concatenate(nodes), np.concatenate(faces)
