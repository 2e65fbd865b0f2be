"""Put a simulation's result into the scene: moving sensors, force curves, the indenter where it was, pictures."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..objects import axes, curves, indenter_objects, mesh_cache
from ..settings import properties
from . import set_style
from .scene_bridge import motion_of, sensor_of

STANDING = "{} simulated"
MOVED = "moved "  # before a sensor's name, in a worker's result
_BOUNDS = {"sphere": "SPHERE", "cylinder": "CYLINDER"}  # Blender's outlines; the others are boxes


@dataclasses.dataclass(frozen=True)
class Result:
    """Result of a simulation, in the sensor's frame.

    seconds (T,); force (T, 3) N, on the sensor
    apex (T, 3) m, turn (T, 3, 3), columns the indenter's axes: where the indenter stood, on the gel if any

    moved : displacement (T, n, 3) m of each sensor that was solved, by their names
    picked : which tiers, in words, where a bound was given
    """

    seconds: np.ndarray
    force: np.ndarray
    apex: np.ndarray
    turn: np.ndarray
    moved: dict[str, np.ndarray]
    picked: tuple[str, ...]


def sensors_in(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the scene's sensors, the first of each name, skins before gels."""
    found: dict[str, bpy.types.Object] = {}
    for role in ("BIOTAC", "DIGIT"):
        for thing in scene.objects:
            if thing.tactile.role == role:
                found.setdefault(properties.sensor_name(thing), thing)
    return list(found.values())


def read(folder: Path) -> Result:
    """Read the result that the simulation wrote into a job's folder."""
    with np.load(folder / "result.npz") as stored:
        moved = {name.removeprefix(MOVED): stored[name] for name in stored.files if name.startswith(MOVED)}
        picked = tuple(str(text) for text in stored["picked"])
        return Result(stored["seconds"], stored["force"], stored["apex"], stored["axes"], moved, picked)


def bake(context: bpy.types.Context, thing: bpy.types.Object, result: Result) -> str:
    """Bake a result, with the indenter ``thing``, onto the scene's frames; returns a sentence for the user."""
    scene = context.scene
    frames = np.arange(scene.frame_start, scene.frame_end + 1, dtype=float)
    rate = scene.render.fps / scene.render.fps_base
    seconds = result.seconds - result.seconds[0]
    # The mechanics run at the sensor's 100 Hz: each frame shows the nearest of its samples.
    sample = np.abs((frames - scene.frame_start)[:, None] / rate - seconds[None, :]).argmin(axis=1)
    sentences = [*result.picked]
    force = result.force[sample][:, [0, 2, 1]] * np.array([1.0, 1.0, -1.0])
    for sensor in sensors_in(scene):
        moved = result.moved.get(properties.sensor_name(sensor))
        if moved is None:  # it was added while the other process worked
            continue
        told = {"force": force}
        movement = mesh_cache.in_memory(moved[sample], properties.sensor_name(sensor))
        sentences.append(set_style.animate(sensor, movement, frames, sensor.tactile.motion, told))
    if thing.tactile.press_by == "HEIGHT":
        curves.write_curve(thing, "tactile.force", frames, np.linalg.norm(force, axis=1))
    _stand(context, thing, result, sample, frames)
    return "; ".join(sentences)


def _stand(context, thing, result: Result, sample: np.ndarray, frames: np.ndarray) -> None:  # noqa: ANN001
    """Add a solid twin of the indenter that stands where the mechanics had it; the one to move by hand turns to wires.
    frames : (F,) of the scene; sample : (F,) int, the moment of the result that each shows"""
    sensor = sensor_of(context)
    name = STANDING.format(thing.name)
    twin = context.scene.objects.get(name)
    if twin is None:
        twin = bpy.data.objects.new(name, thing.data)
        properties.home_of(thing).objects.link(twin)
    twin.tactile.role = "TWIN"
    twin.parent, twin.rotation_mode, thing.hide_render = sensor, "QUATERNION", True
    # A few thin lines and a body that is seen through: twin and dent stay in view.
    kind = json.loads(thing.tactile.spec or "{}").get("kind")
    thing.display_type, thing.display_bounds_type = "BOUNDS", _BOUNDS.get(kind, "BOX")
    twin.color, twin.show_transparent = (*thing.color[:3], 0.4), True
    relative = indenter_objects.world_axes(thing, sensor)
    foot = indenter_objects.foot_of(thing, relative, context.evaluated_depsgraph_get())
    size = np.linalg.norm(relative, axis=0)
    twin.scale = size
    places = axes.to_blender(result.apex[sample], sensor.tactile.per_metre)
    # Columns of the pose are the body's axes in the sensor's frame; Blender's axes are that frame turned.
    turns = axes.to_blender(result.turn[sample].swapaxes(1, 2), 1.0).swapaxes(1, 2)
    own = relative / size
    quaternions = []
    for turn in turns:
        found = Matrix((turn @ own).tolist()).to_quaternion()
        if quaternions and found.dot(quaternions[-1]) < 0:
            found.negate()  # the same turn, on the near side: curves between keys then take the short way
        quaternions.append(found)
    places = places - np.einsum("tij,j->ti", turns, foot)
    if thing.tactile.press_by == "HEIGHT":
        # Where it does not touch, nothing but its keys says where it is.
        lifted = np.linalg.norm(result.force[sample], axis=1) == 0
        keyed = motion_of(context, thing, sensor, frames)["apex"]
        places[lifted] = (axes.to_blender(keyed, sensor.tactile.per_metre) - foot)[lifted]
    curves.write_curves(twin, "location", frames, places)
    curves.write_curves(twin, "rotation_quaternion", frames, np.array([q[:] for q in quaternions]))
