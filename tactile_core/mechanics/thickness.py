"""Thickness of a sensor where it is touched: the reference for depth in per cent."""

from __future__ import annotations

import functools

import numpy as np

from .. import sensors
from ..geometry.indenters import Indenter, Pose
from .node_areas import rest_normals

DEPTH_LIMIT = 0.6  # of the thickness: the deepest that contacts are asked for
_DEEPEST = 2.4e-3  # m, 60 % of the gel: where the BioTac has no core below, its thickness says little
_STEP = 20e-6  # m, of the march through the BioTac; the last step is divided linearly
_TOUCHES = 0.1e-3  # m: at first touch a node is mostly this near
_FARTHEST = 8e-3  # m, more than from the pad to the finger's axis


def thickness(sensor: str, point: np.ndarray) -> float:
    """Rest distance, m, from the outer surface to the rigid support along the inward normal near ``point`` (3,) m.

    To the flat back of a gel; through skin and fluid to the core, or to the finger's axis where the normal passes the
    core by. Raises TactileError for a sensor that is not there.
    """
    if sensors.is_gel(sensor):
        shape = sensors.shape_of(sensor)
        on_dome, outward = shape.dome_point(float(point[0]), float(point[2]))
        return float((shape.back_y - on_dome[1]) / -outward[1])
    node = int(np.argmin(((sensors.sensor_surface(sensor).rest - point) ** 2).sum(axis=1)))
    return _to_core(sensor, point, rest_normals(sensor)[node])


def _to_core(sensor: str, point: np.ndarray, outward: np.ndarray) -> float:
    """Distance, m, from a point (3,) m of a skin along its inward normal to the core, or to the axis."""
    skin = sensors.skin_of(sensor)
    distance = np.arange(0, _FARTHEST, _STEP)
    x, y, z = (point - distance[:, None] * outward).T
    radius = np.hypot(y - skin.axis_y, z)
    over = radius - skin.core_radius(x, np.arctan2(z, skin.axis_y - y))
    inside = np.flatnonzero(over <= 0)
    if not len(inside):
        return float(distance[np.argmin(radius)])
    last = int(inside[0])
    before = over[last - 1] if last else np.nan
    back = over[last] / (over[last] - before) if np.isfinite(before) else 0.0
    return float(distance[last] - back * _STEP)


def thickness_under(sensor: str, indenter: Indenter, pose: Pose) -> float:
    """Return the thickness, m, at the node of the resting surface nearest to an indenter at first touch."""
    surface, reach = sensors.sensor_surface(sensor), _TOUCHES
    nodes, gap = surface.blocks.near(indenter, pose, reach)
    while not len(nodes):
        reach *= 4
        nodes, gap = surface.blocks.near(indenter, pose, reach)
    return _thickness_at(sensor, int(nodes[np.argmin(gap)]))


@functools.cache
def _thickness_at(sensor: str, node: int) -> float:
    """The thickness, m, at a node of the resting surface; kept, for a path asks again at each step."""
    place = sensors.sensor_surface(sensor).rest[node]
    return thickness(sensor, place) if sensors.is_gel(sensor) else _to_core(sensor, place, rest_normals(sensor)[node])


def depth_at(share: float, sensor: str, indenter: Indenter, pose: Pose) -> float:
    """Return the depth, m, of a share of the thickness under an indenter at first touch; at most 2.4 mm."""
    return min(share * thickness_under(sensor, indenter, pose), _DEEPEST)
