"""Fields of the points that a picture's pixels see, for compositing: heights, normals, contact, displacement."""

from __future__ import annotations

import numpy as np

from .height_map import of_unit
from .perspective import lookup, map_lookup, slopes
from .renderer import Renderer

_STEPS, _STILL = 12, 1e-7  # most steps of the search for where a seen point rests; m, largest move that ends it


def seen_fields(
    renderer: Renderer, heights: np.ndarray, displacement: np.ndarray, touched: np.ndarray
) -> dict[str, np.ndarray]:
    """Return fields, float32, of the gel points that a renderer's pixels see, in the shared frame: Height (H, W) m
    toward the camera; Normal (H, W, 3), of length 1, outward; Contact (H, W), share that is touched; Displacement (H,
    W, 3) m.
    heights : (H, W) m, of ``height_map``; displacement : (n, 3) m; touched : (n,) 0 to 1, of the nodes"""
    camera, surface = renderer.camera, renderer.camera.surface
    heights = of_unit(heights, renderer.calibration)
    seen = renderer.view(heights)
    near = (1 - seen / camera.apparent_height).astype(np.float32)
    right, down = near * camera.right[None, :], near * camera.down[:, None]
    at_place = map_lookup(right.astype(np.float32), down.astype(np.float32), camera)
    to_right, to_down = (at_place(slope) for slope in slopes(heights, camera))
    normal = np.stack([camera.down_x * to_down, -np.ones_like(seen), camera.right_z * to_right], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)

    values = np.concatenate([displacement, np.asarray(touched)[:, None]], 1)
    fields = np.moveaxis(surface.grid(values)[surface.window], -1, 0).astype(np.float32)
    along, across = surface.window_axes
    x, z = camera.centre_x + camera.down_x * down, camera.centre_z + camera.right_z * right
    aside = np.zeros((2, *seen.shape), np.float32)  # how far the point seen has moved: it rested at x - aside[0], ...
    for _ in range(_STEPS):
        row, column = (x - aside[0] - along.start) / along.step, (z - aside[1] - across.start) / across.step
        at_rest = lookup(row.astype(np.float32), column.astype(np.float32), fields.shape[1:])
        before, aside = aside, np.stack([at_rest(fields[axis]) for axis in (0, 2)])
        if np.abs(aside - before).max() < _STILL:
            break
    *moved, touch = (at_rest(field) for field in fields)
    return {"Height": seen, "Normal": normal, "Contact": touch, "Displacement": np.stack(moved, -1)}
