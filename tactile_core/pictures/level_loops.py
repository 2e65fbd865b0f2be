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
    change, level, line = (
        np.empty((3, width), np.float32),
        np.empty(width, np.float32),
        np.empty((width, 3), np.float32),
    )
    for row in range(height):
        for led in range(3):
            for column in range(width):
                change[led, column] = radiance[led, row, column] - rest[led, row, column]
        for channel in range(3):
            level[:] = 0
            for led in range(3):
                for column in range(width):
                    level[column] += response[channel, led, row, column] * change[led, column]
            line[:, channel] = level
        seen, ground, levels = picture[row].ravel(), background[row].ravel(), line.ravel()
        for k in range(3 * width):
            value = np.rint(levels[k] + ground[k])
            seen[k] = np.uint8(np.int32(min(max(value, lowest), largest)))  # by way of 32 bits: vectorised
    return picture
