"""A compiled loop of ``Renderer.picture``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


@Loop
def in_picture(radiance, rest, response, background, largest):  # noqa: ANN001, ANN201
    """Compute (H, W, 3) uint8: background (H, W, 3) + response (3, 3, H, W) times radiance less that at rest (3, H, W).

    largest : float32, level
    """
    height, width = background.shape[:2]
    picture, lowest = np.empty((height, width, 3), np.uint8), np.float32(0)
    level = np.empty(width, np.float32)
    for row in range(height):
        for channel in range(3):
            level[:] = 0
            for led in range(3):
                for column in range(width):
                    change = radiance[led, row, column] - rest[led, row, column]
                    level[column] += response[channel, led, row, column] * change
            for column in range(width):
                value = np.rint(level[column] + background[row, column, channel])
                picture[row, column, channel] = np.uint8(min(max(value, lowest), largest))
    return picture
