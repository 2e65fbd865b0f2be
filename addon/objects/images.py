"""Image datablocks and the arrays in them. Arrays have the picture's first row first, Blender's pixels the last."""

from __future__ import annotations

import zlib

import bpy
import numpy as np

from ...tactile_core import sensors
from ...tactile_core.files.png_writer import png_file
from ..settings import properties

_PICTURE, _HEIGHTS = "{} picture", "{} height map"  # of a sensor


def new_image(name: str, width: int, height: int, *, floats: bool = False) -> bpy.types.Image:
    """Make an image of this name and size, the old one where it fits.

    Bytes are a picture in sRGB, which editors show as it is; floats are data.
    """
    found = bpy.data.images.get(name)
    if found is not None and (tuple(found.size) != (width, height) or found.is_float != floats):
        bpy.data.images.remove(found)
        found = None
    if found is None:
        found = bpy.data.images.new(name, width, height, alpha=False, float_buffer=floats, is_data=floats)
    return found


def fill(image: bpy.types.Image, values: np.ndarray) -> None:
    """Set the pixels: values (H, W, 3) or (H, W), 0..1 or, in float images, anything."""
    pixels = np.ones((*values.shape[:2], 4), np.float32)
    pixels[..., :3] = values[::-1] if values.ndim == 3 else values[::-1, :, None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def packed_mask(name: str, values: np.ndarray) -> bpy.types.Image:
    """Make an image of values (H, W) bool, packed as a PNG of one bit per pixel, in place of one of its name.

    Set as pixels, a long recording's values would take gigabytes for a moment.
    """
    former = bpy.data.images.get(name)
    if former is not None:
        bpy.data.images.remove(former)
    rows = np.pad(np.packbits(values, axis=1), ((0, 0), (1, 0)))  # each begins with its filter: none
    packed = png_file(values.shape[::-1], 1, 0, zlib.compress(rows.tobytes()))
    image = bpy.data.images.new(name, 1, 1)
    image.pack(data=packed, data_len=len(packed))
    image.source = "FILE"
    return image


def picture_of(gel: bpy.types.Object) -> bpy.types.Image | None:
    """Return the picture of a gel's sensor, if it was drawn."""
    return bpy.data.images.get(_PICTURE.format(_title(gel)))


def _title(gel: bpy.types.Object) -> str:
    return sensors.title(properties.sensor_name(gel))


def show_picture(gel: bpy.types.Object, picture: np.ndarray) -> bpy.types.Image:
    """Show the picture (H, W, 3) uint8 of a gel in its sensor's datablock."""
    image = new_image(_PICTURE.format(_title(gel)), picture.shape[1], picture.shape[0])
    image.use_fake_user = True  # kept in the file, even while no editor shows it
    fill(image, picture.astype(np.float32) / 255)
    return image


def show_heights(gel: bpy.types.Object, heights: np.ndarray) -> bpy.types.Image:
    """Write a gel's heights (H, W) m into its sensor's image datablock, in millimetres, and return the image."""
    image = new_image(_HEIGHTS.format(_title(gel)), heights.shape[1], heights.shape[0], floats=True)
    image.use_fake_user = True
    fill(image, 1e3 * heights)
    return image


def pack() -> None:
    """Pack pictures and height maps, so that a saved file holds them as they are."""
    titles = [title for _, title, _ in properties.sensor_items(gels_only=True)]
    for name in [form.format(title) for title in titles for form in (_PICTURE, _HEIGHTS)]:
        image = bpy.data.images.get(name)
        # Blender 5.0 empties an image that is packed again without a change.
        if image is not None and (image.packed_file is None or image.is_dirty):
            image.pack()
