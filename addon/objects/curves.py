"""Write and read whole F-curves, however Blender 4.2 to 5.2 stores them."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

CONSTANT, LINEAR = 0, 1  # bpy.types.Keyframe.interpolation as numbers; BEZIER is 2
UNKNOWN = -1e-6  # m, of an expected error: a keyed property holds no NaN
PROPERTIES = {  # custom ones of a sensor, keyframed: for drivers of the user's own
    "electrodes": "Change of the electrodes against rest, counts",
    "pdc": "Fluid pressure as recorded, counts",
    "force": "Force of the object on the BioTac, N, along the finger, across it, and into the pad (negative Z)",
    "second_force": "Likewise of the weaker of two contacts; 0 where one is found",
    "second_center_mm": "Place of that contact on the unrolled DIGIT, x and z, mm",
    "confidence": "1: signals like those of the training, 0: far from them",
    "explained": "Share of the electrodes' change that the translated contact explains; 0 without contact",
    "expected_error_um": "Largest node error of this surface that half of such frames stay below, micrometres;"
    " below 0 where it is not known",
    "dent_um": "Largest displacement of a node of this surface, micrometres",
    "flags": "What is remarkable about the frame, as bits; the tab Tactile says it in words",
}


def fcurves_of(owner: bpy.types.ID) -> Any:
    """Return the F-curves of a datablock's action; a datablock without an action gets one."""
    animation = owner.animation_data or owner.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(f"{owner.name} Tactile")
    action = animation.action
    if not hasattr(action, "slots"):  # before Blender 4.4
        return action.fcurves
    if animation.action_slot is None:
        animation.action_slot = next(
            (slot for slot in action.slots if slot.target_id_type == owner.id_type), None
        ) or action.slots.new(id_type=owner.id_type, name=owner.name)
    layer = action.layers[0] if action.layers else action.layers.new("Tactile")
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(animation.action_slot, ensure=True).fcurves


def write_curve(
    owner: bpy.types.ID, path: str, frames: np.ndarray, values: np.ndarray, index: int = 0, lines: int = LINEAR
) -> None:
    """Write the F-curve of one property through values (T,) at frames (T,) of the scene, in place of an earlier curve.

    path, index : the property's data path, and which of its numbers
    lines : LINEAR joins the values by straight lines, CONSTANT holds each until the next"""
    curves = fcurves_of(owner)
    old = curves.find(path, index=index)
    if old is not None:
        curves.remove(old)
    curve = curves.new(path, index=index)
    curve.keyframe_points.add(len(frames))
    points = np.column_stack([frames, values]).astype(np.float32)
    curve.keyframe_points.foreach_set("co", points.ravel())
    curve.keyframe_points.foreach_set("interpolation", np.full(len(frames), lines, np.int32))
    curve.update()


def write_curves(owner: bpy.types.ID, path: str, frames: np.ndarray, values: np.ndarray, lines: int = LINEAR) -> None:
    """Write one F-curve per column of ``values`` (T, k) at ``frames`` (T,); owner, path, lines : of ``write_curve``"""
    for index in range(values.shape[1]):
        write_curve(owner, path, frames, values[:, index], index, lines)


def points_of(owner: bpy.types.ID, path: str, index: int = 0) -> np.ndarray:
    """Return frame and value (T, 2) of each keyframe of the F-curve with this data path and index; (0, 2) if there is
    none."""
    curve = fcurves_of(owner).find(path, index=index)
    points = np.empty(2 * len(curve.keyframe_points) if curve else 0, np.float32)
    if curve is not None:
        curve.keyframe_points.foreach_get("co", points)
    return points.reshape(-1, 2)


def values_of(owner: bpy.types.ID, path: str, index: int = 0) -> np.ndarray:
    """Return the values (T,) of the keyframes of ``points_of``."""
    return points_of(owner, path, index)[:, 1]


def write_properties(thing: bpy.types.Object, values: dict[str, np.ndarray], frames: np.ndarray) -> None:
    """Set and keyframe custom properties of an object, and remove those that an earlier animation left.

    values : name in ``PROPERTIES`` -> (T,) or (T, k), NaN is written as 0; frames : (T,) of the scene"""
    stale = {f'["{name}"]': name for name in PROPERTIES if name in thing and name not in values}
    for curve in [curve for curve in fcurves_of(thing) if curve.data_path in stale]:
        fcurves_of(thing).remove(curve)
    for name in stale.values():
        del thing[name]
    for name, numbers in values.items():
        bits = name == "flags"  # which mean nothing between two frames
        numbers = np.nan_to_num(np.asarray(numbers, int if bits else np.float64))
        thing[name] = numbers[0].tolist()
        thing.id_properties_ui(name).update(description=PROPERTIES[name])
        lines = CONSTANT if bits else LINEAR
        write_curves(thing, f'["{name}"]', frames, numbers.reshape(len(frames), -1), lines)
