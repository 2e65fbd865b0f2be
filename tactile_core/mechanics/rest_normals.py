"""Outward normals at the nodes of a sensor's resting surface, found once a process."""

from __future__ import annotations

import functools

import numpy as np

from .. import sensors


@functools.cache
def rest_normals(sensor: str) -> np.ndarray:
    """Return the unit outward normals (n, 3) of a sensor's resting surface; not to be written to."""
    from ..sensors.unrolling import node_normals

    surface = sensors.sensor_surface(sensor)
    outward = node_normals(surface.rest, surface.faces)
    outward.flags.writeable = False
    return outward
