"""Write pictures as PNG, with one compression setting for all."""

from __future__ import annotations

import os
import zlib
from typing import BinaryIO

import numpy as np

# Huffman coding of the filtered rows, without zlib's search for repeats: a smooth picture with a camera's grain holds
# none. Measured, a frame of the simulated recording with the shipped background (profile_verbs.py, ``png_*``):
# 40 kB in 4.8 ms; zlib's level 1: 54 kB in 5.2, level 3: 47 kB in 8.7, level 4: 42 kB in 7.7, level 6: 38 kB in 20.7.
PACKING = {"compress_level": 1, "compress_type": zlib.Z_HUFFMAN_ONLY}


def write_png(file: str | os.PathLike | BinaryIO, picture: np.ndarray) -> None:
    """Write a picture (H, W, 3) uint8 to a path or an open file. Raises OSError where the disk refuses."""
    from PIL import Image

    Image.fromarray(picture).save(file, "PNG", **PACKING)
