"""Make Blender images of arrays. An array begins with the picture's top row, Blender's pixels with the bottom row."""

from __future__ import annotations

import zlib

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...tactile_core import sensors
from ...tactile_core.files.png_writer import png_file
from ..settings import properties

_NAMES = {"picture": "{} picture", "heights": "{} height map"}  # property of a gel -> name by its sensor's title


def fill(image: bpy.types.Image, values: np.ndarray) -> None:
    """Set an image's pixels to values (H, W, 3), or (H, W) for grey: 0 to 1, in float images any number."""
    pixels = np.ones((*values.shape[:2], 4), np.float32)
    pixels[..., :3] = values[::-1] if values.ndim == 3 else values[::-1, :, None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def packed_mask(name: str, values: np.ndarray) -> bpy.types.Image:
    """Make an image of values (H, W) bool, packed into the .blend as a PNG of one bit per pixel.

    Set as pixels instead, a long recording's values would take gigabytes for a moment.
    """
    rows = np.pad(np.packbits(values, axis=1), ((0, 0), (1, 0)))  # each begins with its filter: none
    packed = png_file(values.shape[::-1], 1, 0, zlib.compress(rows.tobytes()))
    image = bpy.data.images.new(name, 1, 1)
    image.pack(data=packed, data_len=len(packed))
    image.source = "FILE"
    return image


def image_of(gel: bpy.types.Object, kind: str) -> bpy.types.Image | None:
    """Return a gel's own image of a kind, "picture" or "heights"; None if it has not been drawn yet.

    A copied gel refers to the original's image until it is drawn itself: the gel first by name owns a shared image."""
    own = getattr(gel.tactile, kind)
    image = own or bpy.data.images.get(_NAMES[kind].format(_title(gel)))
    gels = (thing for thing in bpy.data.objects if thing.tactile.role == "DIGIT" and thing != gel)
    others = (thing for thing in gels if thing.users_scene)
    before = (thing for thing in others if own is None or thing.name_full < gel.name_full)
    return None if any(getattr(thing.tactile, kind) == image for thing in before) else image


def _title(gel: bpy.types.Object) -> str:
    return sensors.title(properties.sensor_name(gel))


def show(gel: bpy.types.Object, kind: str, values: np.ndarray) -> bpy.types.Image:
    """Write values into a gel's own image of a kind and return it.
    values : (H, W, 3) uint8, sRGB, for the kind "picture"; (H, W) m for "heights", whose image holds millimetres"""
    image, floats, size = image_of(gel, kind), kind == "heights", values.shape[1::-1]
    if image is not None and (tuple(image.size) != size or image.is_float != floats):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        name = _NAMES[kind].format(_title(gel))
        image = bpy.data.images.new(name, *size, alpha=False, float_buffer=floats, is_data=floats)
    if getattr(gel.tactile, kind) != image:
        setattr(gel.tactile, kind, image)
    image.use_fake_user = True  # kept in the file, even while no editor shows it
    fill(image, 1e3 * values if floats else values.astype(np.float32) / 255)
    return image


@persistent
def pack(*_: object) -> None:
    """Pack pictures and height maps, so that a saved file holds them as they are; Blender calls it before a save."""
    for image in {getattr(thing.tactile, kind) for thing in bpy.data.objects for kind in _NAMES} - {None}:
        # Blender 5.0 empties an image that is packed again without a change.
        if image.packed_file is None or image.is_dirty:
            image.pack()
