"""Write pictures as PNG, with one compression setting for all."""

from __future__ import annotations

import functools
import importlib.util
import io
import os
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

# Huffman coding of the filtered rows, without zlib's search for repeats: a smooth picture with a camera's grain holds
# none. Measured, a frame of the simulated recording with the shipped background:
# 40 kB in 4.8 ms; zlib's level 1: 54 kB in 5.2, level 3: 47 kB in 8.7, level 4: 42 kB in 7.7, level 6: 38 kB in 20.7.
PACKING = {"compress_level": 1, "compress_type": zlib.Z_HUFFMAN_ONLY}
# Where the extra [fast] is installed libdeflate packs: 39 kB in 2.3 ms where the other takes 5.4; level 2: 40 in 2.0.
# With the camera's noise drawn into them pictures take a fifth more space than by Huffman coding alone.
LEVEL = 3
SIGNATURE = b"\x89PNG\r\n\x1a\n"  # a file's first bytes
UP = 2  # PNG's filter of each row: less the row above, modulo 256


def write_png(file: str | os.PathLike, picture: np.ndarray) -> None:
    """Write a picture (H, W, 3) uint8 to a PNG file. Raises OSError if the disk refuses."""
    Path(file).write_bytes(pack_png(picture))


def pack_png(picture: np.ndarray, packing: Mapping[str, int] = PACKING) -> bytes:
    """Return the PNG of a picture (H, W, 3) uint8; packing : options of Pillow's PNG, used without libdeflate"""
    if _has_libdeflate():
        return _packed(picture)
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG", **packing)
    return content.getvalue()


@functools.cache
def _has_libdeflate() -> bool:
    return importlib.util.find_spec("deflate") is not None


def _packed(picture: np.ndarray) -> bytes:
    """Return the PNG of a picture (H, W, 3) uint8, packed by libdeflate, each row less the one above."""
    import deflate

    height, width, _ = picture.shape
    rows = picture.reshape(height, -1)
    filtered = np.empty((height, 1 + rows.shape[1]), np.uint8)
    filtered[:, 0], filtered[0, 1:] = UP, rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    return png_file((width, height), 8, 2, bytes(deflate.zlib_compress(filtered.data, LEVEL)))


def png_file(size: tuple[int, int], depth: int, color: int, packed: bytes) -> bytes:
    """Return the bytes of a PNG of ``size`` (width, height) px. depth : bits of a value; color : 0 grey, 2 RGB
    packed : zlib's output for its rows, each behind the number of its filter"""
    head = struct.pack(">IIBBBBB", *size, depth, color, 0, 0, 0)
    chunks = b"IHDR" + head, b"IDAT" + packed, b"IEND"
    return SIGNATURE + b"".join(
        struct.pack(">I", len(each) - 4) + each + struct.pack(">I", zlib.crc32(each)) for each in chunks
    )
