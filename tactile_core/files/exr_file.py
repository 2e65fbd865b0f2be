"""OpenEXR pictures: float32 channels with names, and text beside them; needs the extra [render]."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np

from ..errors import TactileError
from . import atomic, outside

MOST_BYTES = 2**28  # of all channels, unpacked; a render of four times the camera's pixels has 15 MB (assumed enough)
HEIGHT_CHANNELS = ("height", "Y", "Z", "R")  # where a height map of others is looked for, in this order


def write_exr(path: str | os.PathLike, channels: Mapping[str, np.ndarray], about: Mapping[str, str]) -> None:
    """Write channels, name -> (H, W), as float32, whole or not at all; about : name -> text, the attributes"""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **about}
    planes = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    with atomic.new_file(path) as partial, OpenEXR.File(header, planes) as file:
        try:
            file.write(os.fspath(partial))
        except RuntimeError as error:  # what the library raises for a full disk
            raise OSError(str(error)) from error


def read_exr(path: str | os.PathLike) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return an EXR file's channels, name -> (H, W), and text attributes. Raises TactileError for other files."""
    import OpenEXR

    try:
        outside.check(path, "an EXR file")
        _check_size(path)
        with OpenEXR.File(os.fspath(path), separate_channels=True) as file:
            if not file.parts:  # where the library warned that it cannot read them
                raise ValueError("its pixels are damaged")
            planes = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
            about = {name: value for name, value in file.header().items() if isinstance(value, str)}
    except TactileError:
        raise
    except Exception as error:  # the library raises RuntimeError and others
        raise TactileError(path, f"cannot be read as OpenEXR ({error})", "an EXR file") from error
    return planes, about


def _check_size(path: str | os.PathLike) -> None:
    """Raise ValueError for a deep EXR file, and for one whose parts declare over `MOST_BYTES` in all."""
    import OpenEXR

    size, flat = 0, (OpenEXR.scanlineimage, OpenEXR.tiledimage)
    with OpenEXR.File(os.fspath(path), header_only=True) as file:
        for part in file.parts:
            if part.header.get("type", flat[0]) not in flat:
                raise ValueError("a deep picture")
            (left, bottom), (right, top) = (corner.tolist() for corner in part.header["dataWindow"])
            size += (right - left + 1) * (top - bottom + 1) * len(part.header["channels"]) * 4
    if size > MOST_BYTES:
        raise ValueError(f"{size / 2**20:.0f} MB of pixels, over {MOST_BYTES // 2**20} MB")


def read_height(path: str | os.PathLike) -> np.ndarray:
    """Return heights (H, W) m: the only channel of an EXR file, or the first of height, Y, Z, R; else TactileError."""
    planes, _ = read_exr(path)
    if len(planes) == 1:
        return next(iter(planes.values()))
    for name in HEIGHT_CHANNELS:
        if name in planes:
            return planes[name]
    expected = "one channel, or one called height"
    raise TactileError(path, f"channels {', '.join(planes) or 'none'}", expected)
