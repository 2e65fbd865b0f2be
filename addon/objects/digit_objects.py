"""Add a sensor's gel to the scene, and read its displacement back, whatever moves it."""

from __future__ import annotations

import bpy
import numpy as np

from ...tactile_core import sensors
from ...tactile_core.errors import TactileError
from ..settings import properties
from . import axes, mesh_cache, motion, styles, surfaces
from .style_nodes import DISPLACEMENT

GEL_COLOUR = (0.75, 0.75, 0.78, 1.0)
_BEHIND = 60e-3  # m between the gels of one skin along the finger: a housing, and the legend at its base
BESIDE = 35.1e-3  # m between skin and gel: a legend's width, and a gap


def add_gel(
    group: bpy.types.Collection, per_metre: float, beside: bpy.types.Object | None = None, sensor: str = sensors.TARGET
) -> bpy.types.Object:
    """Add a sensor's gel at rest to a collection and return the new object. It stands beside the skin ``beside``, if
    given, takes over that skin's indenters, and stands the further toward -x the more gels the collection has.
    per_metre : Blender units in a metre"""
    surface = sensors.sensor_surface(sensor)
    name = f"{sensors.title(sensor)} gel"
    gel = surfaces.new_mesh_object(name, axes.to_blender(surface.rest, per_metre), surface.faces)
    properties.set_up(gel, "DIGIT", per_metre, sensor)
    others = sum(thing.tactile.role == "DIGIT" for thing in group.objects)
    group.objects.link(gel)
    surfaces.paint(gel, GEL_COLOUR)
    styles.get_ready(gel)
    if beside is not None:
        gel.location = beside.location
        gel.location.y += BESIDE * per_metre
        for thing in beside.children:
            if thing.tactile.role == "INDENTER":  # where both are, its places refer to the gel
                thing.parent = gel
    gel.location.x -= others * _BEHIND * per_metre
    return gel


def displacement_of(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """Return the displacement (n, 3) m of the gel's nodes as the scene has them now, all keys and modifiers applied.

    Raises TactileError if the gel is hidden or in Edit Mode, where Blender shows it at rest, if its mesh was moved
    within the object, if modifiers changed the number of vertices, or if the mesh cache that moves it is missing.
    """
    if not any(each.object.original == gel for each in depsgraph.object_instances):
        found = f"hidden in view layer {depsgraph.view_layer.name}"
        raise TactileError(gel.name, found, "a gel that is shown", "Show it, and its collection, in renders too")
    mesh_cache.check(gel)
    motion.check_rest(gel)
    rest = properties.surface_of(gel).rest
    mesh = gel.evaluated_get(depsgraph).data
    vertices = mesh.vertices
    if len(vertices) != len(rest):
        advice = "Remove modifiers that add or merge some"
        raise TactileError(gel.name, f"{len(vertices)} vertices", f"the gel's {len(rest)}", advice)
    nodes = np.empty(len(rest) * 3, np.float32)
    styled = mesh.attributes.get(DISPLACEMENT)
    if styled is not None:  # a style may draw the dent larger than it is
        styled.data.foreach_get("vector", nodes)
        return axes.to_sensor(nodes.reshape(-1, 3), gel.tactile.per_metre)
    vertices.foreach_get("co", nodes)
    # Less the rest as Blender holds it: rounded to float32, so that an untouched gel gives zeros.
    rest = axes.to_blender(rest, gel.tactile.per_metre)
    return axes.to_sensor(nodes.reshape(-1, 3) - rest, gel.tactile.per_metre)
