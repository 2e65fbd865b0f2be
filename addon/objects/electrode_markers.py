"""Add small balls under the skin, one per electrode, coloured by the electrode's signal."""

from __future__ import annotations

import bpy
import numpy as np

from ...tactile_core import sensors
from ..settings import properties
from . import axes, curves, frame_attribute, surfaces

NEAREST, DISTANCE = "electrode", "electrode_distance"  # of the skin's nodes: which, from 0, and how far, m
_RADIUS = 0.45e-3  # m, of a marker: electrodes themselves are smaller, and hard to see
_REST = np.array([0.85, 0.85, 0.85])
_HIGH, _LOW = np.array([0.9, 0.05, 0.02]), np.array([0.02, 0.15, 0.9])  # film thinner, film thicker


def add_markers(skin: bpy.types.Object, change: np.ndarray, frames: np.ndarray) -> None:
    """Add the markers E1, E2, ..., in place of former ones; red while a reading is above rest, blue while below.

    change : (T, e) counts against rest; the largest has the strongest colour; frames : (T,) of the scene"""
    for old in [thing for thing in skin.children if thing.tactile.role == "ELECTRODE"]:
        bpy.data.objects.remove(old)
    colours = colours_of(change)
    ball = _ball(skin.tactile.per_metre)
    places = sensors.electrodes(properties.sensor_name(skin))
    for k, place in enumerate(axes.to_blender(places, skin.tactile.per_metre)):
        marker = bpy.data.objects.new(f"E{k + 1}", ball)
        properties.set_up_part(marker, skin, "ELECTRODE")
        marker.location = place
        if not ball.materials:
            surfaces.paint(marker, (*_REST, 1.0))
        marker.color = (*colours[0, k], 1.0)
        curves.write_curves(marker, "color", frames, colours[:, k])


def add_counts(skin: bpy.types.Object, change: np.ndarray, frames: np.ndarray) -> None:
    """Give each node of the skin, as an attribute, the change (T, e), counts against rest, of the nearest electrode.
    frames : (T,), evenly spaced, of the scene"""
    rest, places = properties.surface_of(skin).rest, sensors.electrodes(properties.sensor_name(skin))
    # An electrode shows where the skin is nearest to it.
    over = rest[np.linalg.norm(rest[:, None] - places, axis=-1).argmin(0)]
    distance = np.linalg.norm(rest[:, None] - over, axis=-1)
    for name, kind, values in ((NEAREST, "INT", distance.argmin(1).astype(np.int32)),
                               (DISTANCE, "FLOAT", distance.min(1).astype(np.float32))):  # fmt: skip
        known = skin.data.attributes.get(name) or skin.data.attributes.new(name, kind, "POINT")
        known.data.foreach_set("value", values)
    step = frames[1] - frames[0] if len(frames) > 1 else 1.0
    frame_attribute.add(skin, frame_attribute.COUNTS, change.astype(np.float32), frames[0], step, NEAREST)


def colours_of(change: np.ndarray) -> np.ndarray:
    """Convert change (T, e), counts against rest, to RGB (T, e, 3), 0 to 1: grey for 0, red above it, blue below."""
    share = change / max(float(np.abs(change).max(initial=0.0)), 1.0)
    strength = np.sqrt(np.abs(share))[..., None]  # light touches show too
    return _REST + strength * (np.where(share[..., None] > 0, _HIGH, _LOW) - _REST)


def _ball(per_metre: float) -> bpy.types.Mesh:
    import bmesh

    mesh = bpy.data.meshes.new("Electrode")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=2, radius=_RADIUS * per_metre)
    shape.to_mesh(mesh)
    shape.free()
    return mesh
