"""Fingertips as data: surfaces, materials, electrodes. Each constant is in its sensor's descriptor.

All sensors share one frame, that of the public meshes, in metres: x along the finger, tip toward -x; y normal to the
pad, contact side -y; z lateral. ``descriptor`` documents ``<name>/sensor.toml``; a DIGIT unit's camera and lights are
in its calibration, which ``calibration_file`` documents.
"""

from __future__ import annotations

import functools

import numpy as np

from ..geometry.lattice import Lattice
from .descriptor import describe, of_kind
from .electrodes import contact_pressures_of, contacts_of, places_of, typical_rest
from .fluid_sensor import FALLS, Fluid
from .gel_sensor import GelSensor
from .gel_shape import shape_of
from .skin_shape import skin_of
from .toml_fields import Material
from .unrolling import node_normals, roll_up

__all__ = [
    "COUNT_MAX", "COUNT_SIGN", "ELECTRODES", "PAIR", "PRESSURE_PER_COUNT", "REST_COUNTS", "SAMPLE_RATE", "SOURCE",
    "SP", "TARGET", "Lattice", "Material", "biotac_surface", "contact_pressures_of", "contacts_of", "describe",
    "digit_surface", "electrode_count", "electrodes", "excitation_electrodes", "from_maker", "is_gel", "places_of",
    "rest_normals", "sensor_surface", "shape_of", "skin_of", "surface_point", "thickness", "thickness_at", "title",
    "typical_rest",
]  # fmt: skip

SP = "biotac_sp"  # which some formats of recordings are of
PAIR = SOURCE, TARGET = "biotac", "digit"  # of the weights that ship, and where no other sensors are named

_BIOTAC = of_kind(SOURCE, Fluid)
_READOUT = _BIOTAC.readout
ELECTRODES = _BIOTAC.electrodes.count
SAMPLE_RATE = _READOUT.rate  # Hz, one frame of all electrodes
COUNT_MAX = 2**_READOUT.bits - 1
# Counts of a typical unit without contact: mean impedance of two real units, made even across the finger
# (docs/sources.md, BioTac read-out). E1 and E11, whose film is thinnest, respond 1.8 times as strongly as E2 to E5.
REST_COUNTS = places_of(SOURCE).rest_counts
COUNT_SIGN = -1.0 if _READOUT.polarity == FALLS else 1.0  # of a change where the film over an electrode thins
PRESSURE_PER_COUNT = _READOUT.pressure  # Pa per count of PDC


def electrode_count(sensor: str) -> int:
    """Return how many electrodes of a fluid sensor are read. Raises TactileError for another kind of sensor."""
    return of_kind(sensor, Fluid).electrodes.count


def electrodes(sensor: str = "biotac") -> np.ndarray:
    """Return places (e, 3) m, shared frame, of electrodes that are read, E1 first. TactileError: no or bad table."""
    places = from_maker(1e-3 * places_of(sensor).sensing, sensor)
    skin_of(sensor).check_inside(places)
    return places


def excitation_electrodes(sensor: str = "biotac") -> np.ndarray:
    """Return places (4, 3) m, shared frame, of the excitation electrodes X1..X4; the BioTac's are from a drawing
    (docs/sources.md). TactileError: no fluid sensor, no or bad table."""
    return from_maker(1e-3 * places_of(sensor).excitation, sensor)


def from_maker(points: np.ndarray, sensor: str) -> np.ndarray:
    """Transform points (n, 3) m from the frame of a fluid sensor's maker to the shared one (docs/sources.md, Frame)."""
    frame = skin_of(sensor).descriptor.frame
    x, y, z = np.asarray(points).T
    return np.column_stack([-x - frame.shift_x, z + frame.shift_y, frame.lateral_sign * y])


def biotac_surface() -> Lattice:
    """Return the BioTac's outer skin at rest, 3,650 nodes, ordered as in ``SkinShape.skin_surface``."""
    return skin_of(SOURCE).skin_surface("outer")


def digit_surface() -> Lattice:
    """Return the DIGIT's coated gel surface at rest, 2,867 nodes, ordered as in ``GelShape.surface``."""
    return shape_of(TARGET).surface()


def sensor_surface(sensor: str) -> Lattice:
    """Return the resting surface of a sensor, by its name, such as ``"biotac"`` or ``"digit"``."""
    return shape_of(sensor).surface() if is_gel(sensor) else skin_of(sensor).skin_surface("outer")


@functools.cache
def rest_normals(sensor: str) -> np.ndarray:
    """Return the unit outward normals (n, 3) of a sensor's resting surface; read-only."""
    surface = sensor_surface(sensor)
    outward = node_normals(surface.rest, surface.faces)
    outward.flags.writeable = False
    return outward


def surface_point(sensor: str, x: float, z: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the point (3,) m of a resting surface, and its outward unit normal (3,), at ``x``, ``z``, m, of the plane
    that a gel covers and a pad unrolls onto."""
    return shape_of(sensor).dome_point(x, z) if is_gel(sensor) else roll_up(np.array([x, z]), sensor)


@functools.cache
def thickness_at(sensor: str, node: int) -> float:
    """Return the distance at rest, m, from a node of the outer surface to the rigid support along the inward normal: to
    the flat back of a gel; through skin and fluid to the core, or to the finger's axis if the normal misses the core.
    """
    point = sensor_surface(sensor).rest[node]
    if is_gel(sensor):
        return shape_of(sensor).thickness_below(point)
    return skin_of(sensor).thickness_below(point, rest_normals(sensor)[node])


def is_gel(sensor: str) -> bool:
    """Return true for a gel, false for skin and fluid. Raises TactileError for an unknown sensor."""
    return isinstance(describe(sensor), GelSensor)


def thickness(sensor: str) -> float:
    """Return the thickness, m, of a gel at its apex, or of the skin."""
    return shape_of(sensor).thickness if is_gel(sensor) else skin_of(sensor).thickness


def title(sensor: str) -> str:
    """Return a sensor's name in words."""
    return describe(sensor).title
