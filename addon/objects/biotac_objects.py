"""Add a sensor of skin and fluid, such as a BioTac, to the scene: its skin and core, in a collection of their own."""

from __future__ import annotations

import bpy
import numpy as np

from ...tactile_core import sensors
from ...tactile_core.geometry.lattice import grid_faces
from ..settings import properties
from . import axes, sensor_bodies, styles, surfaces

SKIN_COLOUR = (0.25, 0.55, 0.45, 0.35)  # see-through, so that core and electrodes show
CORE_COLOUR = (0.08, 0.08, 0.1, 1.0)
# Inside the part of the profile table where every ray meets the core, which the descriptor names.
_MARGIN, _ANGLE_MARGIN = 0.1e-3, np.radians(5.0)  # m and rad


def new_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """Make a collection in the scene and return it."""
    group = bpy.data.collections.new(name)
    scene.collection.children.link(group)
    return group


def add_skin(group: bpy.types.Collection, per_metre: float, sensor: str = sensors.SOURCE) -> bpy.types.Object:
    """Add a sensor's outer skin at rest to a collection, return the new object. per_metre : Blender units in a metre"""
    surface = sensors.sensor_surface(sensor)
    name = f"{sensors.title(sensor)} skin"
    skin = surfaces.new_mesh_object(name, axes.to_blender(surface.rest, per_metre), surface.faces)
    properties.set_up(skin, "BIOTAC", per_metre, sensor)
    group.objects.link(skin)
    surfaces.paint(skin, SKIN_COLOUR)
    styles.get_ready(skin)
    return skin


def add_core(group: bpy.types.Collection, skin: bpy.types.Object) -> None:
    """Add children to the skin: the rigid core under its pad, and bone and nail, which hold it."""
    sensor = properties.sensor_name(skin)
    shape = sensors.skin_of(sensor)
    known = shape.descriptor.core
    (first, last), half = known.contact_x, known.contact_half_angle - _ANGLE_MARGIN
    x, angle = np.linspace(first + _MARGIN, last - _MARGIN, 48), np.linspace(-half, half, 47)
    grid_x, grid_angle = (values.ravel() for values in np.meshgrid(x, angle, indexing="ij"))
    radius = shape.core_radius(grid_x, grid_angle)
    nodes = np.stack([grid_x, shape.axis_y - radius * np.cos(grid_angle), radius * np.sin(grid_angle)], axis=-1)
    faces = grid_faces(len(x), len(angle), closed=False)
    faces = faces[np.isfinite(nodes[faces]).all(axis=(1, 2))]
    used, faces = np.unique(faces, return_inverse=True)
    per_metre = skin.tactile.per_metre
    name, places = f"{sensors.title(sensor)} core", axes.to_blender(nodes[used], per_metre)
    core = surfaces.new_mesh_object(name, places, faces.reshape(-1, 3))
    properties.set_up(core, "CORE", per_metre)
    group.objects.link(core)
    core.parent = skin
    surfaces.paint(core, CORE_COLOUR)
    sensor_bodies.add_parts(skin)
