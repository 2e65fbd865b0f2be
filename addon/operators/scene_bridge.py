"""Turn a Blender scene into a ``tactile_core`` scene: which indenter presses, where it goes, how hard it presses."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ..objects import curves, indenter_objects, motion
from ..settings import properties

PRESSED = "tactile_pressed"  # property of an indenter: first frame, and path, m, that its forces were found for
DEFAULTS = {"format": "tactile-scene-1", "name": "scene", "description": "Made in Blender."}
DIGITS_S, DIGITS_MM, DIGITS_N = 6, 5, 7  # decimals kept of float32 keyframes
_STRAIGHT = 1e-7  # m and N, off a straight line, taken for float32's rounding


@dataclasses.dataclass(frozen=True)
class Authored:
    """Scene made from Blender's objects.

    scene : a ``tactile_core.simulation.scene.Scene``; meshes : file name -> content of each mesh that it names
    apexes : (P, 3) m, where the indenter's tip stood at each point of its path; None if forces say how hard it presses
    """

    scene: Any
    meshes: dict[str, bytes]
    apexes: np.ndarray | None


def rate_of(scene: bpy.types.Scene) -> float:
    """Return a scene's frames per second."""
    return scene.render.fps / scene.render.fps_base


def indenter_of(context: bpy.types.Context) -> bpy.types.Object:
    """Return the indenter to simulate: the active object if it is one, else the scene's first. Raises TactileError."""
    found = properties.of_role(context.scene, "INDENTER", context.object)
    if found is None:
        raise TactileError("Tactile", "no indenter", "one in the scene", "Add > Tactile > an indenter")
    if found.type != "MESH":
        raise TactileError(found.name, f"a {found.type.lower()}", "a mesh", "Convert it to a mesh")
    return found


def sensors_for(scene: bpy.types.Scene, near: bpy.types.Object | None) -> list[bpy.types.Object]:
    """List the sensors that the indenter ``near`` presses, one of each name, skins before gels. One in its collections
    is preferred; one elsewhere that plays an imported recording counts only if there is no other."""
    homes = () if near is None else {*near.users_collection, *(near.parent or near).users_collection}
    beside = {thing for group in homes for thing in group.objects}
    there = [thing for role in ("BIOTAC", "DIGIT") for thing in scene.objects if thing.tactile.role == role]
    own = [thing for thing in there if thing in beside or not _plays_recording(thing)] or there
    found: dict[str, bpy.types.Object] = {}
    for thing in sorted(own, key=lambda thing: (thing.tactile.role, thing not in beside)):
        found.setdefault(properties.sensor_name(thing), thing)
    return list(found.values())


def _plays_recording(sensor: bpy.types.Object) -> bool:
    return any(thing.tactile.known for thing in properties.home_of(sensor).objects)


def check_free(*pressed: bpy.types.Object) -> None:
    """Raise TactileError for a sensor that plays an imported recording: its electrodes, trust and flags would stay."""
    for thing in filter(_plays_recording, pressed):
        found, advice = "plays an imported recording", "Use a scene for each"
        raise TactileError(thing.name, found, "a sensor of its own to press", advice)


def sensor_of(context: bpy.types.Context, near: bpy.types.Object | None) -> bpy.types.Object:
    """Return the sensor in whose frame places of the indenter ``near`` are: the gel (of several, the one with the
    scene's camera), else the skin. Raises TactileError if there is none, or if it is edited."""
    there = sensors_for(context.scene, near)
    if not there:
        raise TactileError("Tactile", "no sensor", "a BioTac or a DIGIT in the scene", "Add > Tactile > a sensor")
    gels = [thing for thing in there if thing.tactile.role == "DIGIT"]
    seen = properties.gel_of(context.scene)
    found = seen if seen in gels else (gels or there)[0]
    motion.check_rest(found)
    return found


def authored(context: bpy.types.Context) -> Authored:
    """Return the scene as Blender has it now. Raises TactileError if it cannot be simulated."""
    from ...tactile_core.simulation.scene import Scene

    thing, scene = indenter_of(context), context.scene
    sensor = sensor_of(context, thing)
    properties.check_format(thing)
    if not thing.visible_get():  # then it does not move
        advice = "Show it (Alt H)"
        raise TactileError(thing.name, "hidden, so that it stands still", "an indenter that is shown", advice)
    if scene.frame_end <= scene.frame_start:
        raise TactileError(
            scene.name, f"frames {scene.frame_start} to {scene.frame_end}", "two frames or more",
            "Set the scene's frame range to the motion",
        )  # fmt: skip
    # A scene of one's own can be paired too, under the press's friction; an imported one keeps what it had.
    pairs = {name: value for name, value in _press(thing).items() if name == "friction"}
    document = DEFAULTS | {"pairs": pairs} | json.loads(thing.tactile.document or "{}")
    meshes: dict[str, bytes] = {}
    # Other indenters of the file stand in the scene as well, in the order they were added.
    others = [other for other in scene.objects if other.tactile.role == "INDENTER" and other != thing]
    specs = _specs([thing, *others], sensor, context, meshes)
    kept = document.pop("recording", None) or {}
    by_height = thing.tactile.press_by == "HEIGHT"
    frames, values = _path(context, thing, sensor, by_height)
    points = _points(scene, frames, values, kept.get("points", []))
    pressing = specs[0].name
    order = {name: k for k, name in enumerate(document.pop("order", []))}
    specs.sort(key=lambda spec: order.get(spec.name, len(order)))
    recording = {"noise_counts": 1.0, "drift_counts": 3.0} | kept | _press(thing)
    recording |= {"indenter": pressing, "points": points}
    return Authored(_scene(Scene, document, specs, recording), meshes, values["apex"] if by_height else None)


def _press(thing: bpy.types.Object) -> dict[str, float]:
    """Return an indenter's friction and tilt, rounded from Blender's float32; {} if its file is too old for them."""
    about = thing.tactile
    values = {"friction": round(about.friction, 5), "tilt_deg": round(math.degrees(about.tilt), 4)}
    return values if about.format >= 2 else {}


def _scene(kind: type, document: dict, specs: list, recording: dict) -> Any:
    import msgspec

    whole = document | {"indenters": msgspec.to_builtins(specs), "recording": recording}
    try:
        return msgspec.convert(whole, kind)
    except msgspec.ValidationError as error:
        raise TactileError("Tactile scene", str(error), "what a scene file may hold") from error


def _specs(things, sensor, context, meshes: dict[str, bytes]) -> list:  # noqa: ANN001
    """List the specs of the indenters ``things``; specs of the same name, as duplicates have, get their objects' names.
    meshes : gets file name -> content of each mesh that a spec names"""
    import msgspec

    specs, depsgraph = [], context.evaluated_depsgraph_get()
    for thing in things:
        spec, content = indenter_objects.spec_of(thing, indenter_objects.world_axes(thing, sensor), depsgraph)
        specs.append(spec)
        if content is not None:
            meshes[spec.file] = content
    names = [spec.name for spec in specs]
    own = [bpy.path.clean_name(thing.name) if names.count(thing_name) > 1 else thing_name
           for thing, thing_name in zip(things, names, strict=True)]  # fmt: skip
    return [msgspec.structs.replace(spec, name=name) for spec, name in zip(specs, own, strict=True)]


def _path(context, thing, sensor, whole: bool) -> tuple[np.ndarray, dict[str, np.ndarray]]:  # noqa: ANN001
    """Return frames (P,) of the scene and the path of the indenter ``thing`` there, as ``motion_of`` does: at its keys
    alone if it is straight between them, whatever moves it or the sensor. whole : true for every frame"""
    scene = context.scene
    frames = np.arange(scene.frame_start, scene.frame_end + 1, dtype=float)
    values = motion_of(context, thing, sensor, frames)
    moves = thing.animation_data
    moving = curves.fcurves_of(thing) if moves is not None and moves.action is not None else ()
    keyed = {float(point.co.x) for curve in moving for point in curve.keyframe_points}
    if whole or not keyed:
        return frames, values
    keys = np.array(sorted({k for k in keyed if frames[0] < k < frames[-1]} | {frames[0], frames[-1]}))
    at = motion_of(context, thing, sensor, keys)
    rows, wanted = (np.column_stack([each["apex"], each["force"]]).T for each in (at, values))
    between = [np.interp(frames, keys, row) for row in rows]
    return (keys, at) if np.allclose(between, wanted, rtol=1e-5, atol=_STRAIGHT) else (frames, values)


def motion_of(context, thing, sensor, frames: np.ndarray) -> dict[str, np.ndarray]:  # noqa: ANN001
    """Return the path of the indenter ``thing`` at frames (P,), fractional ones too: "apex" (P, 3) m, its tip in the
    sensor's frame, and "force" (P,) N. The scene keeps its current frame."""
    scene, now = context.scene, (context.scene.frame_current, context.scene.frame_subframe)
    apex, force = [], []
    upright = np.eye(3) if thing.tactile.spec else None
    try:
        for frame in frames:
            scene.frame_set(int(frame // 1), subframe=float(frame % 1))
            relative = indenter_objects.world_axes(thing, sensor)
            upright = relative if upright is None else upright
            if not np.allclose(relative, upright, atol=1e-4):
                found = f"turned or scaled against the sensor on frame {frame:g}"
                advice = "Remove keys that turn or scale it or the sensor, or parent it to the sensor"
                raise TactileError(thing.name, found, "a body that keeps its axes", advice)
            foot = indenter_objects.foot_of(thing, relative, context.evaluated_depsgraph_get())
            apex.append(indenter_objects.place_of(thing, sensor, foot))
            force.append(thing.tactile.force)
    finally:
        scene.frame_set(now[0], subframe=now[1])
    return {"apex": np.array(apex), "force": np.array(force)}


def _points(scene: bpy.types.Scene, frames: np.ndarray, values: dict, originals: list[dict]) -> list[dict]:
    seconds = (frames - scene.frame_start) / rate_of(scene)
    points = [
        {"time_s": round(float(second), DIGITS_S), "x_mm": round(1e3 * float(apex[0]), DIGITS_MM),
         "z_mm": round(1e3 * float(apex[2]), DIGITS_MM), "force_n": round(float(force), DIGITS_N)}
        for second, apex, force in zip(seconds, values["apex"], values["force"], strict=True)
    ]  # fmt: skip
    return originals if _same(points, originals) else points


def _same(points: list[dict], originals: list[dict]) -> bool:
    """Return true if points equal ``originals``, the imported file's, up to the rounding of float32 keyframes."""
    if len(points) != len(originals):
        return False
    found, wanted = ([list(point.values()) for point in each] for each in (points, originals))
    return bool(np.allclose(found, wanted, rtol=1e-6, atol=1e-5))
