"""Measure an indenter's depth in the resting gel, and move it to a depth: the button Snap to Gel."""

from __future__ import annotations

import functools
import json
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ...tactile_core.errors import TactileError
from ...tactile_core.mechanics.placement import Placement, pose_at
from ..objects import axes, indenter_objects
from ..process.jobs import JobFolder
from ..settings import properties
from ..settings.reports import TactileOperator, require
from .scene_bridge import indenter_of, sensor_of


def depth_of(context: bpy.types.Context, thing: bpy.types.Object) -> float | None:
    """Return how far an indenter stands below its point of first touch, m; negative above it.

    Return None for a mesh of the user's, whose distances take too long for a panel, and if it meets no sensor.
    """
    if not thing.tactile.spec:
        return None
    try:
        sensor = sensor_of(context, thing)
        place = _place(thing, sensor, context.evaluated_depsgraph_get())
        name, (x, z) = properties.sensor_name(sensor), np.round(place[[0, 2]], 7)
        apex, direction = _touch(name, thing.tactile.spec, x, z, thing.tactile.tilt)
    except TactileError:
        return None
    return float((place - apex) @ direction)


def _place(thing: bpy.types.Object, sensor: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    relative = indenter_objects.world_axes(thing, sensor)
    return indenter_objects.place_of(thing, sensor, indenter_objects.foot_of(thing, relative, depsgraph))


@functools.lru_cache(maxsize=64)  # a panel asks at each redraw
def _touch(sensor: str, spec: str, x: float, z: float, tilt: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the point (3,) m where a body first touches a sensor at rest, and the direction (3,) in which it presses.
    spec : of the body, a JSON text; x, z : m, place on the sensor; tilt : rad, of the press against the normal"""
    import msgspec

    from ...tactile_core.simulation.indenter_specs import IndenterSpec

    indenter = msgspec.convert(json.loads(spec), IndenterSpec).build()
    pose = pose_at(sensor, indenter, Placement(x, z, tilt))
    return pose.apex, pose.direction


class TACTILE_OT_snap_to_gel(TactileOperator):
    """Move the indenter along the press until it touches the resting gel, or is as deep as asked"""

    bl_idname = "tactile.snap_to_gel"
    bl_label = "Snap to Gel"

    depth: bpy.props.FloatProperty(
        name="Depth", description="Below the point of first touch, mm; negative: above it", default=0.0, soft_min=-5.0,
        soft_max=2.0, precision=3,
    )  # fmt: skip

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true if there is an indenter and a sensor for it to touch."""
        scene = context.scene
        if properties.of_role(scene, "INDENTER", context.object) is None:
            cls.poll_message_set("Add an indenter first")
            return False
        return any(properties.of_role(scene, role) for role in ("DIGIT", "BIOTAC"))

    def _work(self, context: bpy.types.Context) -> None:
        require("msgspec")
        thing = indenter_of(context)
        sensor = sensor_of(context, thing)
        properties.check_own(thing)
        depsgraph = context.evaluated_depsgraph_get()
        place = _place(thing, sensor, depsgraph)
        name, built = properties.sensor_name(sensor), self._built(thing, sensor, depsgraph)
        pose = pose_at(name, built, Placement(place[0], place[2], thing.tactile.tilt))
        moved = pose.apex + 1e-3 * self.depth * pose.direction - place
        world = sensor.matrix_world.to_3x3() @ Vector(axes.to_blender(moved, sensor.tactile.per_metre))
        matrix = thing.matrix_world.copy()
        matrix.translation += world
        thing.matrix_world = matrix

    def _built(self, thing: bpy.types.Object, sensor: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Any:
        """Return the indenter as it is simulated."""
        import msgspec

        spec, mesh = indenter_objects.spec_of(thing, indenter_objects.world_axes(thing, sensor), depsgraph)
        if mesh is None:
            return spec.build()
        require("trimesh", "rtree", "scipy")
        with JobFolder() as folder:
            path = folder / spec.file
            path.write_bytes(mesh)
            return msgspec.structs.replace(spec, file=str(path)).build()


CLASSES = (TACTILE_OT_snap_to_gel,)
