"""The fast picture of a gel as the scene has it now."""

from __future__ import annotations

import functools

import bpy
import numpy as np

from ..tactile_core import height_map, shading
from . import digit_objects, images


@functools.cache
def shader() -> shading.Shader:
    """The DIGIT's fast shader, made once."""
    return shading.Shader()


def fast_picture(displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Picture (H, W, 3) uint8 and heights (H, W) m of a displacement (n, 3) m."""
    heights = height_map.height_map(displacement)
    return shader()(heights), heights


def update(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Image:
    """Draw picture and height map of the current frame into their datablocks; returns the picture's."""
    picture, heights = fast_picture(digit_objects.displacement_of(gel, depsgraph))
    images.show_heights(heights)
    return images.show_picture(picture)


def update_picture(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """The picture alone: 2 ms less, which count while scrubbing."""
    images.show_picture(fast_picture(digit_objects.displacement_of(gel, depsgraph))[0])
