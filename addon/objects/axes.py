"""Convert between the sensors' or a picture's frame in metres and Blender's axes in the scene's units.

The sensors' frame (``tactile_core.sensors``): x along the finger, y normal to the pad with the contact side at -y, z
lateral. In Blender the pad looks up: X = x, Y = z, Z = -y, a rotation. Lengths follow the scene: one Blender unit is
``unit_settings.scale_length`` metres. The importers set it to 0.001 unless asked otherwise, so that a fingertip is 28
units long and the viewport's clipping and grid suit it; the sidebar then shows millimetres.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ...tactile_core.errors import TactileError
from ...tactile_core.sensors.camera import Camera

_SIGNS = np.array([1.0, 1.0, -1.0], np.float32)


def to_blender(points: np.ndarray, per_metre: float) -> np.ndarray:
    """Convert points or displacements (..., 3) m from the sensors' frame to Blender's axes and units, float32.
    per_metre : Blender units in a metre"""
    return np.asarray(points, np.float32)[..., [0, 2, 1]] * (_SIGNS * np.float32(per_metre))


def to_sensor(points: np.ndarray, per_metre: float) -> np.ndarray:
    """Convert points or displacements (..., 3) from Blender's axes and units to the sensors' frame, float64 m.
    per_metre : Blender units in a metre"""
    x, y, z = np.moveaxis(np.asarray(points, np.float64) / per_metre, -1, 0)
    return np.stack([x, -z, y], -1)


def from_world(sensor: bpy.types.Object) -> Matrix:
    """Return the matrix from world axes to a sensor object's own. Raises TactileError for an object scaled to 0."""
    try:
        return sensor.matrix_world.inverted()
    except ValueError:
        advice = "Clear its scale (Alt S)"
        raise TactileError(sensor.name, "a scale of 0", "a scale other than 0", advice) from None


def units_per_metre(scene: bpy.types.Scene) -> float:
    """Return how many Blender units make a metre."""
    return 1.0 / scene.unit_settings.scale_length


def use_millimetres(scene: bpy.types.Scene) -> None:
    """Make one Blender unit a millimetre, shown as such."""
    units = scene.unit_settings
    units.system, units.scale_length, units.length_unit = "METRIC", 1e-3, "MILLIMETERS"


def to_gel(places: np.ndarray, camera: Camera, per_metre: float) -> np.ndarray:
    """Convert places (..., 3) m in the picture's frame (right, down, toward the camera) to the gel object's axes and
    units. camera : the one that makes the picture; per_metre : Blender units in a metre"""
    right, down, toward = np.moveaxis(np.asarray(places, float), -1, 0)
    x, z = camera.centre_x + camera.down_x * down, camera.centre_z + camera.right_z * right
    return to_blender(np.stack([x, camera.height_zero_y + toward, z], -1), per_metre)


def from_gel(places: np.ndarray, camera: Camera, per_metre: float) -> np.ndarray:
    """Convert places (..., 3) in the gel object's axes and units to the picture's frame, float64 m; undoes ``to_gel``.
    camera : the one that makes the picture; per_metre : Blender units in a metre"""
    x, y, z = np.moveaxis(to_sensor(places, per_metre), -1, 0)
    right, down = camera.right_z * (z - camera.centre_z), camera.down_x * (x - camera.centre_x)
    return np.stack([right, down, y - camera.height_zero_y], -1)
