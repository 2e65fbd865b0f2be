"""A compiled loop of ``Renderer.picture``."""

from __future__ import annotations

import numpy as np

from ..files.compiled import Loop


def in_picture(
    radiance: np.ndarray, rest: np.ndarray, response: np.ndarray, background: np.ndarray, largest: np.float32
) -> np.ndarray:
    """Compute (H, W, 3) uint8: background (H, W, 3) + response (3, 3, H, W) times radiance less that at rest (3, H, W).

    All float32; largest : level
    """
    picture = np.empty(background.shape, np.uint8)
    rows = len(picture), -1
    _fill_levels(radiance, rest, response, background.reshape(rows), largest, picture.reshape(rows))
    return picture


@Loop
def _fill_levels(radiance, rest, response, background, largest, picture):  # noqa: ANN001, ANN202
    """Fill in the picture of ``in_picture``; background, picture : (H, 3 W)."""
    _, height, width = radiance.shape
    lowest, change, line = np.float32(0), np.empty((3, width), np.float32), np.empty(3 * width, np.float32)
    for row in range(height):  # a row stays in the processor's cache
        for led in range(3):
            for column in range(width):
                change[led, column] = radiance[led, row, column] - rest[led, row, column]
        for channel in range(3):
            for column in range(width):
                level = np.float32(0)
                for led in range(3):
                    level += response[channel, led, row, column] * change[led, column]
                line[3 * column + channel] = level
        for k in range(3 * width):
            value = np.rint(line[k] + background[row, k])
            picture[row, k] = np.uint8(np.int32(min(max(value, lowest), largest)))  # by way of 32 bits: vectorised
