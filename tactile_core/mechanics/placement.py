"""Placement of an indenter, the same unrolled place and angle on both sensors, and the thickness of a sensor there.

The thickness is the reference for depth in per cent.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from .. import sensors
from ..geometry.indenters import Indenter, Pose, pose_on
from .first_touch import first_touch

FRICTION = 0.78  # Coulomb's coefficient of the BioTac's skin (docs/sources.md, BioTac skin), taken for both sensors


@dataclasses.dataclass(frozen=True)
class Placement:
    """Place and angle of an indenter, the same for both sensors.

    x, z : m on the DIGIT's plane, along the finger and across it; on the BioTac, the place that unrolls onto it
    tilt : rad, angle between the indenter's axis and the surface normal; tilt_heading : rad, direction of that lean

    >>> tactile.Placement(x=2e-3, z=0.0, tilt=0.1)
    """

    x: float
    z: float
    tilt: float = 0.0
    tilt_heading: float = 0.0


def pose_at(sensor: str, indenter: Indenter, place: Placement) -> Pose:
    """First touch on a sensor: on a gel at (x, z), on a skin at the place of its pad that rolls onto (x, z) of a gel.

    The indenter leans as much off the dome's normal as off the skin's.
    """
    point, outward = sensors.surface_point(sensor, place.x, place.z)
    pose = pose_on(indenter, point, outward, place.tilt, place.tilt_heading)
    return first_touch(sensors.sensor_surface(sensor), indenter, pose)


def on_gel(x: float, z: float, margin: float = 0.0, sensor: str = sensors.TARGET) -> bool:
    """Return true if a place of the common plane lies on a sensor's gel, at least ``margin`` m inside its outline."""
    return bool(sensors.shape_of(sensor).outline_distance(np.array(x), np.array(z)) > margin)


DEPTH_LIMIT = 0.6  # of the thickness: the deepest that contacts are asked for
_DEEPEST = 2.4e-3  # m, 60 % of the gel: where the BioTac has no core below, its thickness says little
_TOUCHES = 0.1e-3  # m: at first touch a node is mostly this near


def thickness_under(sensor: str, indenter: Indenter, pose: Pose) -> float:
    """Return the thickness, m, at the node of the resting surface nearest to an indenter at first touch."""
    surface, reach = sensors.sensor_surface(sensor), _TOUCHES
    nodes, gap = surface.blocks.near(indenter, pose, reach)
    while not len(nodes):
        reach *= 4
        nodes, gap = surface.blocks.near(indenter, pose, reach)
    return sensors.thickness_at(sensor, int(nodes[np.argmin(gap)]))


def depth_at(share: float, sensor: str, indenter: Indenter, pose: Pose) -> float:
    """Return the depth, m, of a share of the thickness under an indenter at first touch; at most 2.4 mm."""
    return min(share * thickness_under(sensor, indenter, pose), _DEEPEST)
