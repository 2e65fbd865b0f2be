"""A compiled loop of ``Renderer.picture``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def in_picture(radiance, rest, response, background, largest):  # noqa: ANN001, ANN201
    """Picture (H, W, 3) uint8: background + response (3, 3, H, W) times radiance less that at rest, both (H, W, 3)."""
    height, width = background.shape[:2]
    picture = np.empty((height, width, 3), np.uint8)
    for row in range(height):
        for column in range(width):
            for channel in range(3):
                level = np.float32(0.0)
                for led in range(3):
                    change = radiance[row, column, led] - rest[row, column, led]
                    level += response[channel, led, row, column] * change
                level = np.rint(level + background[row, column, channel])
                picture[row, column, channel] = np.uint8(min(max(level, 0.0), largest))
    return picture
