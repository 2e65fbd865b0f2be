"""Placement of an indenter: the same unrolled place and angle on both sensors."""

from __future__ import annotations

import dataclasses

import numpy as np

from .. import sensors
from ..geometry.indenters import Indenter, Pose, pose_on
from ..sensors import unrolling
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


def skin_pose(sensor: str, indenter: Indenter, place: Placement) -> Pose:
    """First touch on a fluid sensor, at the place of its pad that rolls onto (x, z) of the DIGIT's plane."""
    point, outward = unrolling.roll_up(np.array([place.x, place.z]), sensor)
    pose = pose_on(indenter, point, outward, place.tilt, place.tilt_heading)
    return first_touch(sensors.sensor_surface(sensor), indenter, pose)


def gel_pose(sensor: str, indenter: Indenter, place: Placement) -> Pose:
    """First touch on a gel at (x, z), leaning as much off the dome's normal as off the BioTac's."""
    point, outward = sensors.shape_of(sensor).dome_point(place.x, place.z)
    pose = pose_on(indenter, point, outward, place.tilt, place.tilt_heading)
    return first_touch(sensors.sensor_surface(sensor), indenter, pose)


def pose_at(sensor: str, indenter: Indenter, place: Placement) -> Pose:
    """First touch on a sensor."""
    return (gel_pose if sensors.is_gel(sensor) else skin_pose)(sensor, indenter, place)


def on_gel(x: float, z: float, margin: float = 0.0, sensor: str = sensors.TARGET) -> bool:
    """Return true if a place of the common plane lies on a sensor's gel, at least ``margin`` m inside its outline."""
    return bool(sensors.shape_of(sensor).outline_distance(np.array(x), np.array(z)) > margin)
